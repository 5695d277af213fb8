//! What kind of drive the device is: which objects it has, and what it does at SYNC0.

use crate::cia402::Cia402;
use crate::dictionary::Dictionary;
use crate::motion::Valve;
use crate::pulse_train::PulseTrain;
use crate::settings::{Kind, Settings};
use crate::{objects, pulse_train};

/// A drive of either kind.
#[derive(Debug, Clone)]
pub(crate) enum Profile {
    Cia402(Box<Cia402>),
    PulseTrain(PulseTrain),
}

impl Profile {
    pub(crate) fn new(settings: &Settings, valve: &Valve) -> (Self, Dictionary) {
        match settings.kind {
            Kind::Cia402 => {
                let objects = objects::cia402(settings, valve.units_per_revolution());
                (Self::Cia402(Box::new(Cia402::new(settings, valve))), objects)
            }
            Kind::PulseTrain => {
                (Self::PulseTrain(PulseTrain::new(settings, valve)), pulse_train::objects(settings))
            }
        }
    }

    pub(crate) fn energised(&self) -> bool {
        match self {
            Self::Cia402(drive) => drive.energised(),
            Self::PulseTrain(_) => true,
        }
    }

    pub(crate) fn motion(&self) -> (i64, i64) {
        match self {
            Self::Cia402(drive) => drive.motion(),
            Self::PulseTrain(terminal) => terminal.motion(),
        }
    }

    pub(crate) fn sync(
        &mut self,
        objects: &mut Dictionary,
        valve: &Valve,
        settings: &Settings,
        fresh: bool,
        period_s: f64,
    ) {
        match self {
            Self::Cia402(drive) => drive.sync(objects, valve, settings, fresh, period_s),
            Self::PulseTrain(terminal) => terminal.sync(objects, fresh),
        }
    }

    pub(crate) fn bus_lost(&mut self, objects: &mut Dictionary) {
        match self {
            Self::Cia402(drive) => drive.bus_lost(objects),
            Self::PulseTrain(terminal) => terminal.bus_lost(objects),
        }
    }
}
