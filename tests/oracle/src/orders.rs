//! What operators wanted, and when: the one thing that allows a valve to move.

/// What an operator wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// That the valve may move: arm, or home.
    Move,
    /// That it stops: disarm.
    Stop,
}

/// An operator's order, as it was given; whether it was obeyed is not asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// What is wanted.
    pub wish: Wish,
    /// The cycle in which it was given.
    pub from_cycle: u64,
    /// The last cycle in which it may be obeyed.
    pub until_cycle: u64,
}

/// All orders of a run. Each allows the drive to be told once to begin to follow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Orders {
    all: Vec<(Order, bool)>,
    pub(crate) unknown: bool,
}

impl Orders {
    pub(crate) fn add(&mut self, order: Order) {
        self.all.push((order, false));
    }

    /// Uses up an order under which the drive may begin to follow in this cycle, `late` cycles after it was obeyed at the
    /// latest; whether there was one.
    pub(crate) fn use_up(&mut self, cycle: u64, late: u64) -> bool {
        let allows = |order: &Order| {
            order.wish == Wish::Move
                && (order.from_cycle..=order.until_cycle.saturating_add(late)).contains(&cycle)
        };
        let found = self.all.iter_mut().find(|(order, used)| !used && allows(order));
        found.map(|(_, used)| *used = true).is_some() || self.unknown
    }

    /// The newest order before this cycle, if that is one to stop: the cycle in which it was given.
    pub(crate) fn stop_before(&self, cycle: u64) -> Option<u64> {
        let given = self.all.iter().map(|(order, _)| order).filter(|order| order.from_cycle < cycle);
        let newest = given.max_by_key(|order| order.from_cycle)?;
        (newest.wish == Wish::Stop && !self.unknown).then_some(newest.from_cycle)
    }
}
