//! `stepvalve bus scan`: who is on a drive's bus, and a drive file to begin with.

use crate::say::say;
use anyhow::anyhow;
use ethercat_link::{Found, PacketLink, scan};
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
        (Some(kind), _) => say(format_args!("   device type {kind:#010x}, not a CiA 402 drive")),
    }
}

/// A drive file with what the device tells; the rest is to be filled in.
fn proposal(device: &Found) -> String {
    let terminal = (device.vendor, device.product) == (2, 0x09DA_3052);
    let profile = if terminal { "el2522" } else { "cia402-csp" };
    let units = device.units_per_rev.unwrap_or(0);
    let Found { name, vendor, product, revision, .. } = device;
    let lacks: Vec<_> = device.absent.iter().map(|object| format!("\"{object}\"")).collect();
    let absent = match lacks.is_empty() {
        true => String::new(),
        false => format!(
            "# Its dictionary does not have these: its manual has to say what it does instead.\nabsent = [{}]\n",
            lacks.join(", ")
        ),
    };
    format!(
        "\nformat = \"stepvalve-drive\"\nformat_version = 1\nname = \"{name}\"\nprofile = \"{profile}\"\n\
         vendor = {vendor:#010x}\nproduct = {product:#010x}\nrevision_min = {revision:#010x}\n\
         units_per_rev = {units}          # must be the model's micro-steps of a revolution\n\
         direction = \"positive\"          # to be tried, with little current\n\
         position_is_measured = false    # true where 0x6064 comes from an encoder\n{absent}"
    )
}
