//! "Did you mean": the known name nearest to a misspelt one.

/// The nearest of `known` within two edits (a third of the name's length at most), if any.
pub(crate) fn nearest<'k>(name: &str, known: &'k [String]) -> Option<&'k str> {
    const LONGEST: usize = 80;
    let length = name.chars().count();
    if length > LONGEST {
        return None;
    }
    let most_edits = (length / 3).clamp(1, 2);
    let scored = known.iter().map(|candidate| (strsim::levenshtein(name, candidate), candidate.as_str()));
    scored
        .filter(|&(count, _)| count <= most_edits)
        .min_by_key(|&(count, _)| count)
        .map(|(_, candidate)| candidate)
}
