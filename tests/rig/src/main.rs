//! `hidden-effect-rig`: writes a campaign's log, its nominal model, and the truth.

use anyhow::{Context, Result, anyhow};
use clap::{Parser, ValueEnum};
use hidden_effect_rig::{
    Campaign, Family as RigFamily, Hidden, LAWS, LogKind, OUTSIDE, STRONG, WEAK, effects_of, gap_from_name,
    ordered,
};
use std::path::PathBuf;

/// Draws a campaign from a seed: DIR/log.h5, DIR/model.toml and DIR/truth.json.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Where everything else comes from
    #[arg(long)]
    seed: u64,
    /// The effects to hide, by name, separated by commas; "none" for none, "list" to print them
    #[arg(long, default_value = "none")]
    hidden: String,
    /// Residual over noise: 5, or 2
    #[arg(long, value_enum, default_value = "strong")]
    strength: Strength,
    /// A torque log, or one with command and angle
    #[arg(long, value_enum, default_value = "torque")]
    log: Log,
    /// What the measurement is like: one corner of the world, or drawn as wide as it is
    #[arg(long, value_enum, default_value = "exact")]
    family: Family,
    /// What the plan leaves out: one-pressure, sliding-only, no-shake, one-frequency, trend, one-way, gentle, no-presliding
    #[arg(long)]
    without: Option<String>,
    /// About how many samples
    #[arg(long, default_value_t = 60_000)]
    samples: usize,
    /// Neither noise nor encoder steps
    #[arg(long)]
    noise_free: bool,
    /// Make these runs (next-experiment.toml) behind the campaign's own, and write them alone; those of earlier plans, given first,
    /// are made too
    #[arg(long, value_name = "PLAN.toml")]
    plan: Vec<PathBuf>,
    /// The folder to write
    #[arg(long)]
    out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Strength {
    Strong,
    Weak,
}

#[derive(Clone, Copy, ValueEnum)]
enum Family {
    Exact,
    Real,
}

#[derive(Clone, Copy, ValueEnum)]
enum Log {
    Torque,
    Angle,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let log = match arguments.log {
        Log::Torque => LogKind::Torque,
        Log::Angle => LogKind::Angle,
    };
    if arguments.hidden == "list" {
        effects_of(log).iter().chain(OUTSIDE).chain(LAWS).for_each(|id| println!("{id}"));
        return Ok(());
    }
    let effects: Vec<&str> = arguments.hidden.split(',').filter(|id| *id != "none").collect();
    let known = |id: &&str| [&effects_of(log), OUTSIDE, LAWS].iter().any(|of| of.contains(id));
    if let Some(unknown) = effects.iter().find(|id| !known(id)) {
        return Err(anyhow!("no effect {unknown:?}: --hidden list names them"));
    }
    let strength = match arguments.strength {
        Strength::Strong => STRONG,
        Strength::Weak => WEAK,
    };
    let gap = |name: &String| gap_from_name(name).ok_or_else(|| anyhow!("unknown gap {name:?}"));
    let family = match arguments.family {
        Family::Exact => RigFamily::Exact,
        Family::Real => RigFamily::Real,
    };
    let hidden = Hidden {
        family,
        without: arguments.without.as_ref().map(gap).transpose()?,
        samples: arguments.samples,
        noise_free: arguments.noise_free,
        ..Hidden::with(log, &effects, strength)
    };
    let order = |file: &PathBuf| {
        let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
        ordered(&text).with_context(|| file.display().to_string())
    };
    let orders = arguments.plan.iter().map(order).collect::<Result<Vec<_>>>()?;
    let campaign = if orders.is_empty() {
        Campaign::try_draw(arguments.seed, &hidden)
    } else {
        Campaign::try_order(arguments.seed, &hidden, &orders)
    };
    let campaign =
        campaign.ok_or_else(|| anyhow!("seed {}: no attempt shows what is to be hidden", arguments.seed))?;
    campaign.write(&arguments.out)?;
    let samples: usize = campaign.log.runs.iter().map(log_data::Run::len).sum();
    println!("{}: {} runs, {samples} samples", arguments.out.display(), campaign.log.runs.len());
    Ok(())
}
