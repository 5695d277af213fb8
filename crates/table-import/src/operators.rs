//! What may stand in an expression beside columns: exmex's operators and functions, and comparisons for conditions.

use exmex::prelude::*;
use exmex::{BinOp, FloatOpsFactory, MakeOperators, Operator};

/// Arithmetic, and comparisons that give 1 where they hold and 0 where they don't.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Operators;

/// An expression of numbers.
pub(crate) type Flat = FlatEx<f64, Operators>;

/// How tightly comparisons bind: less than sums, whose priority is 0, and more than "and", which binds more than "or".
const COMPARE: i64 = -1;
const AND: i64 = -2;
const OR: i64 = -3;

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

fn binary<'a>(name: &'a str, priority: i64, apply: fn(f64, f64) -> f64) -> Operator<'a, f64> {
    Operator::make_bin(name, BinOp { apply, prio: priority, is_commutative: false })
}

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let mut all = FloatOpsFactory::<f64>::make();
        all.extend([
            binary("<", COMPARE, |a, b| truth(a < b)),
            binary("<=", COMPARE, |a, b| truth(a <= b)),
            binary(">", COMPARE, |a, b| truth(a > b)),
            binary(">=", COMPARE, |a, b| truth(a >= b)),
            binary("==", COMPARE, |a, b| truth(a == b)),
            binary("!=", COMPARE, |a, b| truth(a != b)),
            binary("&&", AND, |a, b| truth(a != 0.0 && b != 0.0)),
            binary("||", OR, |a, b| truth(a != 0.0 || b != 0.0)),
        ]);
        all
    }
}
