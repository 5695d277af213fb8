//! What usually makes an error that depends on a quantity.

/// What usually makes an error that depends on this, and how it is looked for.
pub fn cause_of(on: &str, as_friction: bool) -> (&'static str, &'static str) {
    match on {
        on if on.starts_with("angle") && as_friction => (
            "a shaft or bore out of round, a bent spool, a seal that is worn on one side",
            "turn slowly by a whole turn both ways; loosen or exchange one part, and see whether it moves or goes",
        ),
        on if on.starts_with("angle") => (
            "something that pushes by the angle: an unbalance, a magnet, flow forces, an eccentric coupling or encoder",
            "turn slowly by a whole turn both ways, without pressure and with it; turn the encoder or the coupling by 90° and repeat",
        ),
        on if on.starts_with("speed") => (
            "another friction law than the model's: a Stribeck curve of another form, viscosity, hydrodynamic drag",
            "run constant speeds both ways over the whole range, some three in each decade, at one temperature",
        ),
        on if on.starts_with("acceleration") => (
            "an inertia, a delay of a channel, a coupling that gives",
            "run sines of one amplitude at three frequencies a factor of three apart",
        ),
        on if on.starts_with("pressure") => (
            "seals pressed on by the pressure, or a pressure on an area of the spool",
            "repeat the same runs at zero, half and full pressure, in mixed order",
        ),
        on if on.starts_with("temperature") || on.starts_with("oil") => (
            "oil that becomes thinner, seals that become softer",
            "repeat the same runs cold and warm, 20 K apart",
        ),
        on if on.starts_with("time since rest") || on.starts_with("time_at_rest") => (
            "friction that grows while the contact rests, oil that is squeezed out, a bristle's own time",
            "start after rests of 0.1, 1 and 10 s, in mixed order",
        ),
        on if on.starts_with("motion") => (
            "a motion that the model was not made for, or a part of the record that is no run of its kind",
            "see in the table which runs are worst, and diagnose them alone (--exclude RUN)",
        ),
        on if on.starts_with("run") || on.starts_with("distance") => (
            "something that changes from run to run: a transducer's zero, wear, warming up",
            "repeat the first runs at the end; record the oil's temperature and the transducer's zero before each run",
        ),
        _ => (
            "nothing that is known to depend on it alone",
            "repeat runs that differ in that alone, everything else kept",
        ),
    }
}
