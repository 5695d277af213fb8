//! "Did you mean": the known name nearest to a misspelt one.

/// The nearest of `known` within two edits (a third of the name's length at most), if any.
pub(crate) fn nearest<'k>(name: &str, known: &'k [String]) -> Option<&'k str> {
    const LONGEST: usize = 80;
    let length = name.chars().count();
    if length > LONGEST {
        return None;
    }
    let most_edits = (length / 3).clamp(1, 2);
    let scored = known.iter().map(|candidate| (edits(name, candidate), candidate.as_str()));
    scored
        .filter(|&(count, _)| count <= most_edits)
        .min_by_key(|&(count, _)| count)
        .map(|(_, candidate)| candidate)
}

/// Levenshtein's distance in characters.
fn edits(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (line, from_char) in from.chars().enumerate() {
        let mut diagonal = line;
        let mut left = line + 1;
        let mut next = vec![left];
        for (to_char, &above) in to.iter().zip(row.iter().skip(1)) {
            let replaced = diagonal + usize::from(from_char != *to_char);
            left = replaced.min(left + 1).min(above + 1);
            next.push(left);
            diagonal = above;
        }
        row = next;
    }
    row.last().copied().unwrap_or(0)
}
