//! Who is on the bus: identities, mailbox, clock, for people.

use crate::bring_up::init;
use crate::error::{BringUpError, Step};
use crate::link::Link;
use crate::main_device;
use core::pin::pin;
use core::task::Poll;
use ethercrab::MainDevice;
use ethercrab::error::{CoeAbortCode, Error, MailboxError};
use fieldbus::may_be_absent;
use fieldbus::objects::Object;

/// A scan takes no longer, ns.
const LIMIT_NS: u64 = 10_000_000_000;

/// A device that was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its name in SII.
    pub name: String,
    /// Vendor id.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
    /// Whether it has a distributed clock.
    pub clock: bool,
    /// 0x1000, the device type; `None` without CoE.
    pub device_type: Option<u32>,
    /// 0x6502, the supported modes of a CiA 402 drive.
    pub modes: Option<u32>,
    /// 0x1C32:05, the shortest cycle, ns.
    pub minimum_cycle_ns: Option<u32>,
    /// 0x6092:01, or 0x608F:01: position units of a revolution.
    pub units_per_rev: Option<u32>,
    /// Of a CiA 402 drive: objects that a bring-up asks for, and that its dictionary does not have.
    pub absent: Vec<Object>,
}

impl Found {
    /// Whether it says that it is a drive after CiA 402.
    pub fn is_drive(&self) -> bool {
        is_drive(self.device_type)
    }
}

fn is_drive(device_type: Option<u32>) -> bool {
    device_type.is_some_and(|kind| kind & 0xFFFF == 0x0192)
}

/// Looks who is there, and leaves all of them in PRE-OP. Nothing is written but what a bring-up needs.
///
/// # Errors
/// [`BringUpError`], where they don't come to PRE-OP.
pub fn scan(link: &mut impl Link) -> Result<Vec<Found>, BringUpError> {
    let (main, mut pump) = main_device::make();
    let until = link.now_ns() + LIMIT_NS;
    match pump.poll_until(pin!(look(main)), link, until) {
        Poll::Ready(found) => found,
        Poll::Pending => Err(BringUpError::Timeout { limit_ns: LIMIT_NS }),
    }
}

async fn look(main: &'static MainDevice<'static>) -> Result<Vec<Found>, BringUpError> {
    let group = init(main, |_| Ok(())).await?;
    let mut all = Vec::new();
    for index in 0..group.len() {
        let device =
            group.subdevice(main, index).map_err(|error| BringUpError::Bus { step: Step::Init, error })?;
        let identity = device.identity();
        let number = async |index: u16, sub: u8| device.sdo_read::<u32>(index, sub).await.ok();
        let units = match number(0x6092, 1).await {
            Some(units) => Some(units),
            None => number(0x608F, 1).await,
        };
        let device_type = number(0x1000, 0).await;
        let mut absent = Vec::new();
        // A drive file is proposed for a drive alone.
        if is_drive(device_type) && group.len() == 1 {
            for object in may_be_absent() {
                // An object of another size is there all the same.
                match device.sdo_read::<u32>(object.index, object.sub).await {
                    Err(error) if is_unknown(&error) => absent.push(object),
                    // What does not answer this need not be asked for all of them.
                    Err(Error::Timeout(_)) => break,
                    _ => {}
                }
            }
        }
        all.push(Found {
            name: device.name().to_owned(),
            vendor: identity.vendor_id,
            product: identity.product_id,
            revision: identity.revision,
            serial: identity.serial,
            clock: device.dc_support().any(),
            device_type,
            modes: number(0x6502, 0).await,
            minimum_cycle_ns: number(0x1C32, 5).await,
            units_per_rev: units,
            absent,
        });
    }
    Ok(all)
}

/// Whether a device said that it has no such object.
fn is_unknown(error: &Error) -> bool {
    let Error::Mailbox(MailboxError::Aborted { code, .. }) = error else { return false };
    matches!(code, CoeAbortCode::NotFound | CoeAbortCode::SubIndexNotFound)
}
