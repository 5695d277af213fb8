//! In which order files follow one another on one clock: as they are given, but a shell's `*` puts run-10 before run-2.

use std::cmp::Ordering;
use std::path::PathBuf;

/// The places of the files, in the order in which they follow one another. Where they are given as a shell sorts them, and
/// by the numbers in their names they sort otherwise, it is that of the numbers.
pub(super) fn by_numbers(files: &[PathBuf]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..files.len()).collect();
    if files.is_sorted() {
        let name = |index: &usize| files.get(*index).map_or("".into(), |file| file.to_string_lossy());
        order.sort_by(|one, other| natural(&name(one), &name(other)));
    }
    order
}

/// What to tell of an order that is not the given one.
pub(super) fn told(files: &[PathBuf], order: &[usize]) -> Option<String> {
    let (before, behind) = order.windows(2).find_map(|two| match two {
        [one, other] if one > other => Some((*one, *other)),
        _ => None,
    })?;
    let stem = |index: usize| -> Option<String> {
        Some(files.get(index)?.file_stem()?.to_string_lossy().into_owned())
    };
    Some(format!("the files follow one another by their numbers: {} before {}", stem(before)?, stem(behind)?))
}

/// Compares texts, and numbers in them by their values.
fn natural(one: &str, other: &str) -> Ordering {
    let (mut one, mut other) = (one, other);
    while !one.is_empty() && !other.is_empty() {
        let (first, second) = (part(one), part(other));
        let ordering = match (number(first), number(second)) {
            (Some(first), Some(second)) => (first.len(), first).cmp(&(second.len(), second)),
            _ => first.cmp(second),
        };
        if ordering.is_ne() {
            return ordering;
        }
        one = one.strip_prefix(first).unwrap_or_default();
        other = other.strip_prefix(second).unwrap_or_default();
    }
    one.len().cmp(&other.len())
}

/// The digits, or the text without digits, that a text begins with.
fn part(text: &str) -> &str {
    let digits = text.starts_with(|c: char| c.is_ascii_digit());
    let end = text.find(|c: char| c.is_ascii_digit() != digits).unwrap_or(text.len());
    text.get(..end).unwrap_or(text)
}

/// A number's digits, without the zeros before them.
fn number(part: &str) -> Option<&str> {
    part.starts_with(|c: char| c.is_ascii_digit()).then(|| part.trim_start_matches('0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_as_a_shell_gives_them_follow_their_numbers_and_others_the_one_who_gave_them() {
        let order = |names: &[&str]| {
            let files: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
            let order = by_numbers(&files);
            (order.iter().map(|index| names[*index].to_owned()).collect::<Vec<_>>(), told(&files, &order))
        };
        let (names, said) = order(&["d/run1.csv", "d/run10.csv", "d/run2.csv"]);
        assert_eq!(names, ["d/run1.csv", "d/run2.csv", "d/run10.csv"]);
        assert_eq!(said.unwrap(), "the files follow one another by their numbers: run2 before run10");
        for as_given in [
            &["run-01.csv", "run-02.csv", "run-10.csv"][..],
            &["run3.csv", "run1.csv", "run10.csv"],
            &["a/run10.csv", "b/run2.csv"],
            &["warm.csv"],
            &[],
        ] {
            assert_eq!(order(as_given), (as_given.iter().map(|name| (*name).to_owned()).collect(), None));
        }
        assert_eq!(natural("7a", "007b"), Ordering::Less);
        assert_eq!(natural("run", "run1"), Ordering::Less);
        assert_eq!(natural("run99999999999999999999999", "run100000000000000000000000"), Ordering::Less);
    }
}
