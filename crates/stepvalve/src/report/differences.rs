//! In which lines the texts that two runs were made from differ.

use std::collections::BTreeMap;

/// Name and lines of each text that differs: `A` and `B` before each line that only that run has. Texts of one run alone are left out.
pub fn differences(a: &[(String, String)], b: &[(String, String)]) -> Vec<(String, String)> {
    let both = a.iter().filter_map(|(name, text)| {
        let (_, other) = b.iter().find(|(found, _)| found == name)?;
        let lines: Vec<_> = only("A", text, other).chain(only("B", other, text)).collect();
        (!lines.is_empty()).then(|| (name.clone(), lines.join("\n")))
    });
    both.collect()
}

/// The lines of a text that the other has not, or fewer times.
fn only<'a>(letter: &'a str, text: &'a str, other: &'a str) -> impl Iterator<Item = String> + 'a {
    let mut there = BTreeMap::<&str, usize>::new();
    other.lines().map(str::trim).for_each(|line| *there.entry(line).or_default() += 1);
    text.lines().map(str::trim).filter_map(move |line| match there.get_mut(line) {
        Some(count) if *count > 0 => {
            *count -= 1;
            None
        }
        _ if line.is_empty() => None,
        _ => Some(format!("{letter}  {line}")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_one_alone_are_told() {
        let of = |scenario: &str, truth: &str| {
            [("scenario", scenario), ("truth", truth)]
                .map(|(name, text)| (name.to_owned(), text.to_owned()))
                .to_vec()
        };
        let found = differences(&of("a = 1\nb = 2\n\nb = 2", "x"), &of("a = 1\n  b = 2\nb = 3", "x"));
        assert_eq!(found, [("scenario".to_owned(), "A  b = 2\nB  b = 3".to_owned())]);
        assert_eq!(differences(&of("a", "b"), &[]), []);
    }
}
