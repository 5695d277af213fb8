//! `--record`: how much of a run is kept.

use processes::Keep;

/// `none`, `all` or `ring=SIZE`.
pub fn parse_keep(text: &str) -> Result<Keep, String> {
    let expected =
        || format!("found {text:?}, expected none, all, or ring=SIZE with a size like 500MB or 2GB");
    match text {
        "none" => return Ok(Keep::None),
        "all" => return Ok(Keep::All),
        _ => {}
    }
    let size = text.strip_prefix("ring=").ok_or_else(expected)?;
    let bytes = parse_size(size).ok_or_else(expected)?;
    if bytes < 10_000_000 {
        return Err(format!("found {text:?}, expected at least 10MB: some seconds of a 1 kHz loop"));
    }
    Ok(Keep::Ring { bytes })
}

/// A size like 500MB or 2GB, bytes; `None` for anything else, or more than can be.
pub fn parse_size(text: &str) -> Option<u64> {
    const UNITS: [(&str, u64); 4] = [("GB", 1_000_000_000), ("MB", 1_000_000), ("kB", 1000), ("B", 1)];
    let (number, factor) =
        UNITS.iter().find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, *factor)))?;
    number.trim().parse::<u64>().ok()?.checked_mul(factor)
}

/// How long a ring's record is, in words: `14 min`, `2.3 h`.
pub fn holds(bytes: u64, period_ns: u64, drive: bool) -> String {
    let cycles = bytes as f64 / recording::bytes_per_cycle(drive) as f64;
    match cycles * period_ns as f64 / 60e9 {
        minutes if minutes < 100.0 => format!("{minutes:.0} min"),
        minutes => format!("{:.1} h", minutes / 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_s_length_is_told() {
        assert!(holds(2_000_000_000, 1_000_000, false).ends_with(" min"));
        assert!(holds(2_000_000_000, 10_000_000, true).ends_with(" h"));
    }

    #[test]
    fn sizes() {
        assert_eq!(parse_keep("none"), Ok(Keep::None));
        assert_eq!(parse_keep("ring=500MB"), Ok(Keep::Ring { bytes: 500_000_000 }));
        for bad in ["", "ring", "ring=", "ring=5", "ring=-1GB", "ring=1kB", "ring=99999999999999GB", "ALL"] {
            assert!(parse_keep(bad).is_err(), "{bad}");
        }
    }
}
