//! "Did you mean": the known names nearest to a misspelt one.

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

/// So many of `known`, the most alike first: names of several parts, of which one or two may be wrong altogether.
pub(crate) fn most_alike<'k>(name: &str, known: &'k [String], count: usize) -> Vec<&'k str> {
    let mut scored: Vec<(f64, &str)> = known.iter().map(|of| (likeness(name, of), of.as_str())).collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.into_iter().take(count).map(|(_, of)| of).collect()
}

/// How much of the longer of two names stays where one is edited into the other; the end of a path counts most.
fn likeness(name: &str, other: &str) -> f64 {
    let last = |text: &str| text.rsplit('.').next().unwrap_or_default().to_owned();
    strsim::normalized_levenshtein(name, other) + strsim::jaro_winkler(&last(name), &last(other))
}
