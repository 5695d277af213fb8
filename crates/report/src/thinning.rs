//! Points of an x-y plot that nobody could tell apart, left out.

use std::collections::HashSet;

/// A series keeps at most about this many points.
const MAX_POINTS: usize = 100_000;
/// Cells along each side of the plot: finer than a screen, with room to zoom in.
const FINEST_CELLS: f64 = 16_384.0;
/// The coarsest grid: what does not fit on it is cut off no more.
const COARSEST_CELLS: f64 = 64.0;

type Point = Option<(f64, f64)>;
type Cell = (u32, u32);

/// The points to keep, by index (None for a gap in the line), and how coarse the grid had to be (cells a side; None
/// where all points are kept). Coordinates must be finite, in plotted space (logarithms on log axes). Of a cloud
/// each cell keeps one point; a `line` loses the strokes between two cells that an earlier stroke has joined.
pub(crate) fn thin(points: &[Point], line: bool) -> (Vec<Option<usize>>, Option<f64>) {
    if points.len() <= MAX_POINTS {
        return ((0..points.len()).map(Some).collect(), None);
    }
    let x = crate::encode::span(points.iter().flatten().map(|point| point.0));
    let y = crate::encode::span(points.iter().flatten().map(|point| point.1));
    let scale =
        |(low, high): (f64, f64), value: f64| if high > low { (value - low) / (high - low) } else { 0.0 };
    let mut cells = FINEST_CELLS;
    loop {
        let cell =
            |point: &(f64, f64)| ((scale(x, point.0) * cells) as u32, (scale(y, point.1) * cells) as u32);
        let room = if cells > COARSEST_CELLS { MAX_POINTS } else { usize::MAX };
        let kept = if line { new_strokes(points, cell, room) } else { new_cells(points, cell, room) };
        if let Some(kept) = kept {
            return (kept, Some(cells));
        }
        cells /= 2.0;
    }
}

/// The strokes from cell to cell that were not drawn before, with gaps between those that do not follow on each
/// other; None if they are more than there is room for.
fn new_strokes(
    points: &[Point],
    cell: impl Fn(&(f64, f64)) -> Cell,
    room: usize,
) -> Option<Vec<Option<usize>>> {
    let mut drawn: HashSet<(Cell, Cell)> = HashSet::new();
    let mut kept: Vec<Option<usize>> = Vec::new();
    let mut before: Option<(usize, Cell)> = None;
    for (index, point) in points.iter().enumerate() {
        let here = point.as_ref().map(&cell);
        if let Some(here) = here {
            let from = before.unwrap_or((index, here));
            // A stroke within a cell shows only where it is the cell's first.
            if drawn.insert((from.1, here)) {
                if from.0 != index && kept.last() != Some(&Some(from.0)) {
                    kept.extend([None, Some(from.0)]);
                } else if from.0 == index {
                    kept.push(None);
                }
                kept.push(Some(index));
            }
        }
        before = here.map(|here| (index, here));
        if kept.len() > room {
            return None;
        }
    }
    Some(kept)
}

/// One point of each cell; None if they are more than there is room for.
fn new_cells(
    points: &[Point],
    cell: impl Fn(&(f64, f64)) -> Cell,
    room: usize,
) -> Option<Vec<Option<usize>>> {
    let mut taken = HashSet::new();
    let mut kept = Vec::new();
    for (index, point) in points.iter().enumerate() {
        if point.as_ref().is_some_and(|point| taken.insert(cell(point))) {
            kept.push(Some(index));
            if kept.len() > room {
                return None;
            }
        }
    }
    Some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looping(count: u32) -> Vec<Point> {
        (0..count).map(|k| Some((f64::from(k) * 1e-4).sin_cos())).collect()
    }

    #[test]
    fn a_million_points_are_thinned_and_the_outlier_stays() {
        let mut points = looping(1_000_000);
        points[654_321] = Some((0.3, 7.0));
        points[100] = None;
        for line in [true, false] {
            let (kept, cells) = thin(&points, line);
            assert!(kept.len() <= MAX_POINTS && kept.len() > 1000, "{}", kept.len());
            assert!(kept.contains(&Some(654_321)));
            assert!(cells.is_some_and(|cells| cells >= 2048.0), "{cells:?}");
        }
    }

    #[test]
    fn a_thinned_line_never_joins_what_was_apart() {
        let mut points = looping(200_000);
        points.iter_mut().skip(1000).step_by(5000).for_each(|point| *point = None);
        let (kept, cells) = thin(&points, true);
        let cell = 6.0 / cells.unwrap();
        let mut strokes = 0;
        for pair in kept.windows(2) {
            if let [Some(from), Some(to)] = pair {
                strokes += 1;
                let ((x0, y0), (x1, y1)) = (points[*from].unwrap(), points[*to].unwrap());
                assert!((x1 - x0).hypot(y1 - y0) < cell, "{from} to {to}");
            }
        }
        assert!(strokes > 1000, "{strokes}");
    }

    #[test]
    fn a_few_points_stay_all() {
        let points = [Some((1.0, 1.0)), None, Some((1.0, 1.0))];
        assert_eq!(thin(&points, true), (vec![Some(0), Some(1), Some(2)], None));
    }
}
