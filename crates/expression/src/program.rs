//! A compiled expression: instructions for a stack of numbers.

use crate::function::{Binary, Unary};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Numbers that are kept at once, at most.
pub(crate) const MOST_DEEP: usize = 16;

/// One instruction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Instruction {
    /// Puts a number on the stack.
    Constant(f64),
    /// Puts a variable on the stack, by its place.
    Variable(u8),
    /// Replaces the number on top.
    One(Unary),
    /// Replaces the two numbers on top by one.
    Two(Binary),
}

/// A compiled expression: plain data, which runs without heap, an operation for each instruction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Program {
    pub(crate) code: Vec<Instruction>,
    /// Characters before the place in the text from which each instruction comes.
    pub(crate) places: Vec<u16>,
}

impl Program {
    /// Its value at these variables, in the order they were compiled with.
    #[inline]
    pub fn run<N: Number>(&self, variables: &[N]) -> N {
        self.run_watched(variables, |_, _| {})
    }

    /// As [`Self::run`]; `watch` sees what each instruction leaves on top.
    pub(crate) fn run_watched<N: Number>(&self, variables: &[N], mut watch: impl FnMut(usize, N)) -> N {
        let nothing = N::constant(f64::NAN);
        let mut stack = [nothing; MOST_DEEP];
        let mut depth = 0_usize;
        for (index, instruction) in self.code.iter().enumerate() {
            let at = |back: usize| stack.get(depth.wrapping_sub(back)).copied().unwrap_or(nothing);
            let (taken, made) = match *instruction {
                Instruction::Constant(number) => (0, N::constant(number)),
                Instruction::Variable(place) => {
                    (0, variables.get(usize::from(place)).copied().unwrap_or(nothing))
                }
                Instruction::One(function) => (1, at(1).one(function)),
                Instruction::Two(function) => (2, at(2).two(at(1), function)),
            };
            watch(index, made);
            depth = depth.saturating_sub(taken);
            if let Some(slot) = stack.get_mut(depth) {
                *slot = made;
            }
            depth += 1;
        }
        stack.first().copied().unwrap_or(nothing)
    }

    /// Whether it depends on the variable with this place.
    pub fn uses(&self, variable: usize) -> bool {
        let is = |instruction: &Instruction| matches!(instruction, Instruction::Variable(place) if usize::from(*place) == variable);
        self.code.iter().any(is)
    }
}
