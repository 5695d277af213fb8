//! The valves that faults are tried on: the shipped rotation and sine, short, and stopped after as few silent cycles as a
//! machine takes.

use crate::scenario::repository;
use anyhow::{Context, Result, anyhow};
use closed_loop::{Parts, wire};
use config::{Scenario, parse_model, parse_scenario};
use oracle::Limits;
use toml_edit::{DocumentMut, Item, value};
use valve_model::Model;

/// A valve in motion.
#[derive(Debug, Clone)]
pub struct Ground {
    /// Its name.
    pub name: String,
    /// The scenario's text; models by absolute path.
    pub text: String,
    /// For one thread.
    pub parts: Parts,
    /// What it is made of.
    pub scenario: Scenario,
    /// The plant's model, and the controller's.
    pub models: (Model, Model),
    /// What the oracle holds it to.
    pub limits: Limits,
    /// Largest following error before it is a fault, at full speed, rad.
    pub following_error_rad: f64,
}

/// What the oracle holds a scenario's valve to.
pub fn limits(scenario: &Scenario) -> Limits {
    let driver = &scenario.driver;
    Limits {
        period_s: scenario.period_s(),
        max_pulse_rate_hz: driver.max_pulse_rate_hz,
        max_pulse_acceleration_hz_per_s: driver.max_pulse_acceleration_hz_per_s,
        quick_stop_deceleration_hz_per_s: driver.quick_stop_deceleration_hz_per_s,
        silence_cycles: scenario.safety.silence_cycles,
        command_delay_cycles: scenario.loop_delay_cycles - 1,
        // The controller gives up after 2 s of arming.
        arming_cycles: (2.0 / scenario.period_s()) as u64,
        neutral_pulse_rate_hz: 0.0,
    }
}

/// What is different from the shipped scenario.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    /// `rotation-200khz` or `sine-1hz`.
    pub shipped: &'static str,
    /// The driver's option.
    pub after_stop: &'static str,
    /// 1 or 2.
    pub loop_delay_cycles: i64,
    /// Whether an encoder is fitted.
    pub encoder: bool,
    /// From arming to the end, s.
    pub duration_s: f64,
    /// Cycles of silence.
    pub silence_cycles: i64,
}

/// The variants that campaigns without a clock draw from.
pub const VARIANTS: [Variant; 6] = {
    let rotation = Variant {
        shipped: "rotation-200khz",
        after_stop: "hold",
        loop_delay_cycles: 1,
        encoder: true,
        duration_s: 0.25,
        silence_cycles: 3,
    };
    [
        rotation,
        Variant { after_stop: "de-energise", ..rotation },
        Variant { loop_delay_cycles: 2, ..rotation },
        Variant { encoder: false, ..rotation },
        Variant { silence_cycles: 5, ..rotation },
        Variant { shipped: "sine-1hz", ..rotation },
    ]
};

impl Variant {
    /// Builds it.
    ///
    /// # Errors
    /// Where the shipped scenario is not what it was.
    pub fn ground(&self) -> Result<Ground> {
        let folder = repository().join("rt-config/scenarios");
        let path = folder.join(format!("{}.toml", self.shipped));
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let text = self.changed(text.parse().with_context(|| path.display().to_string())?)?;
        let scenario = parse_scenario(&text, self.shipped).map_err(|errors| anyhow!("{errors}"))?;
        let model = |path: &str| {
            let text = std::fs::read_to_string(path).with_context(|| path.to_owned())?;
            parse_model(&text, path).map_err(|errors| anyhow!("{errors}"))
        };
        let (truth, belief) = (model(&scenario.truth)?, model(&scenario.belief)?);
        let parts = wire(&scenario, &truth, &belief)?;
        let limits = limits(&scenario);
        let safety = scenario.safety;
        let following_error_rad = safety.max_following_error_rad
            + safety.following_error_per_speed_s * scenario.limits.max_speed_rad_per_s;
        let models = (truth, belief);
        Ok(Ground { name: format!("{self:?}"), text, parts, scenario, models, limits, following_error_rad })
    }

    fn changed(&self, mut scenario: DocumentMut) -> Result<String> {
        scenario.insert("duration", value(self.duration_s));
        scenario.insert("loop_delay_cycles", value(self.loop_delay_cycles));
        for model in ["truth", "belief"] {
            let name = scenario.get(model).and_then(Item::as_str).context("a model")?.to_owned();
            let absolute = repository().join("rt-config/scenarios").join(name).canonicalize()?;
            scenario.insert(model, value(absolute.display().to_string()));
        }
        for (table, key, new) in [
            ("driver", "after_stop", value(self.after_stop)),
            ("encoder", "fitted", value(self.encoder)),
            ("safety", "silence_cycles", value(self.silence_cycles)),
        ] {
            let table = scenario.get_mut(table).and_then(Item::as_table_mut).context(table)?;
            table.insert(key, new);
        }
        if !self.encoder {
            let safety = scenario.get_mut("safety").and_then(Item::as_table_mut).context("safety")?;
            safety.remove("lost_steps");
        }
        let points =
            scenario.get_mut("set_point").and_then(Item::as_array_of_tables_mut).context("set-points")?;
        while points.len() > 1 {
            points.remove(points.len() - 1);
        }
        points.get_mut(0).context("a set-point")?.insert("time", value(0.002));
        Ok(scenario.to_string())
    }
}
