//! `stepvalve bus scan`: who is on a drive's bus, and a drive file to begin with.

use crate::say::say;
use anyhow::anyhow;
use ethercat_link::{Found, PacketLink, scan};
use fieldbus::Profile;
use fieldbus::objects::Object;
use supervisor::{Failure, Outcome};

/// Where to look.
#[derive(clap::Args)]
pub struct Scan {
    /// The network interface, with nothing else on it than the drive
    #[arg(value_name = "INTERFACE")]
    interface: String,
}

/// Looks, and proposes.
///
/// # Errors
/// [`Failure::Input`] for an interface that can't be used; [`Failure::Failed`] where devices don't come to PRE-OP.
pub fn run(arguments: &Scan) -> Result<Outcome, Failure> {
    let Scan { interface } = arguments;
    let mut link =
        PacketLink::open(interface).map_err(|error| Failure::Input(anyhow!("{interface}: {error}")))?;
    let devices = scan(&mut link).map_err(|error| Failure::Failed(anyhow!("{interface}: {error}")))?;
    say(format_args!("{interface}: {} devices", devices.len()));
    for (number, device) in devices.iter().enumerate() {
        describe(number, device);
    }
    if let [only] = &*devices {
        say(proposal(only));
    }
    Ok(Outcome::Done)
}

fn describe(number: usize, device: &Found) {
    let Found { name, vendor, product, revision, serial, .. } = device;
    say(format_args!(
        "{number}: {name}: vendor {vendor:#010x}, product {product:#010x}, revision {revision:#010x}, serial {serial}"
    ));
    let clock = if device.clock { "a distributed clock" } else { "NO distributed clock: it can't be used" };
    let cycle =
        device.minimum_cycle_ns.map_or_else(|| "not told".to_owned(), |ns| format!("{} us", ns / 1000));
    say(format_args!("   {clock}; shortest cycle {cycle}"));
    match (device.device_type, device.modes) {
        (None, _) => say(format_args!("   no CoE: not a drive")),
        (Some(_), Some(modes)) if device.is_drive() => {
            let csp = if modes & 0x80 != 0 { "yes" } else { "NO: it can't be used" };
            say(format_args!("   CiA 402 drive; cyclic synchronous position: {csp}"));
        }
        (Some(_), None) if device.is_drive() => {
            say(format_args!(
                "   CiA 402 drive; it does not say which modes it has (0x6502): it must have cyclic synchronous position"
            ));
        }
        (Some(kind), _) => say(format_args!("   device type {kind:#010x}, not a CiA 402 drive")),
    }
}

/// A drive file with what the device tells; the rest is to be filled in.
fn proposal(device: &Found) -> String {
    let terminal = (device.vendor, device.product) == (2, 0x09DA_3052);
    let profile = if terminal { "el2522" } else { "cia402-csp" };
    let units = device.units_per_rev.unwrap_or(0);
    let Found { name, vendor, product, revision, .. } = device;
    let absent = absent(device);
    format!(
        "\nformat = \"stepvalve-drive\"\nformat_version = 1\nname = \"{name}\"\nprofile = \"{profile}\"\n\
         vendor = {vendor:#010x}\nproduct = {product:#010x}\nrevision_min = {revision:#010x}\n\
         units_per_rev = {units}          # must be the model's micro-steps of a revolution\n\
         direction = \"positive\"          # to be tried, with little current\n\
         position_is_measured = false    # true where 0x6064 comes from an encoder\n{absent}"
    )
}

/// What the drive's dictionary does not have. What frames can do without is listed; of the rest, limits, ramps and units among it, a person has to
/// say that the drive needs none of it: until then `run` refuses the drive.
fn absent(device: &Found) -> String {
    let list = |objects: &mut dyn Iterator<Item = &Object>| {
        objects.map(|object| format!("\"{object}\"")).collect::<Vec<_>>().join(", ")
    };
    let spared = |object: &&Object| Profile::Cia402Csp.can_do_without(**object);
    let mut text = String::new();
    if device.absent.iter().any(|object| spared(&object)) {
        text += &format!("absent = [{}]\n", list(&mut device.absent.iter().filter(spared)));
    }
    if !device.absent.iter().all(|object| spared(&object)) {
        text += "# Its dictionary lacks some settings. Look in its manual for what it does instead, and if that will do, list them:\n";
        text += &format!("# absent = [{}]\n", list(&mut device.absent.iter()));
    }
    text
}
