//! Counters of a traversal's work.

use formats::raytrace::Visit;

/// Receives the work of one ray, in order.
pub trait Counter {
    /// Whether it records each visit. Only then can children be visited in the order of the node.
    const RECORDS: bool = false;
    /// A step at an inner node.
    fn step(&mut self, node: u32);
    /// Tests of `count` triangles, starting at a slot, which is looked up only if it is used.
    fn triangles(&mut self, first_slot: impl FnOnce() -> u32, count: u32);
    /// A look-up of a triangle's alpha.
    fn alpha(&mut self);
    /// Entries on the stack after a step.
    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        let _ = entries;
    }
}

/// Counts nothing: the baseline for the cost of counting.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCounter;

impl Counter for NoCounter {
    #[inline(always)]
    fn step(&mut self, _: u32) {}
    #[inline(always)]
    fn triangles(&mut self, _: impl FnOnce() -> u32, _: u32) {}
    #[inline(always)]
    fn alpha(&mut self) {}
}

/// Counts. The alignment lets one store clear them, which saves 2 % of a short ray's time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(align(16))]
pub struct Counts {
    /// Inner nodes visited.
    pub steps: u32,
    /// Triangles tested.
    pub triangle_tests: u32,
    /// Alpha look-ups.
    pub alpha_tests: u32,
}

impl Counter for Counts {
    #[inline(always)]
    fn step(&mut self, _: u32) {
        self.steps += 1;
    }
    #[inline(always)]
    fn triangles(&mut self, _: impl FnOnce() -> u32, count: u32) {
        self.triangle_tests += count;
    }
    #[inline(always)]
    fn alpha(&mut self) {
        self.alpha_tests += 1;
    }
}

/// Counts and records every visit.
#[derive(Debug)]
pub struct Visits<'a> {
    /// Totals.
    pub counts: Counts,
    /// Visits in order. New ones are appended.
    pub list: &'a mut Vec<Visit>,
}

impl Counter for Visits<'_> {
    const RECORDS: bool = true;

    fn step(&mut self, node: u32) {
        self.counts.step(node);
        self.list.push(Visit::Node(node));
    }
    fn triangles(&mut self, first_slot: impl FnOnce() -> u32, count: u32) {
        let first_slot = first_slot();
        self.counts.triangles(|| first_slot, count);
        let slots = first_slot..first_slot + count;
        self.list.extend(slots.map(Visit::Triangle));
    }
    fn alpha(&mut self) {
        self.counts.alpha();
    }
}

/// Another counter, and the most entries on the stack after any step.
#[derive(Debug)]
pub struct StackDepth<C> {
    /// The other counter.
    pub counter: C,
    /// Most entries so far.
    pub entries: u32,
}

impl<C: Counter> Counter for StackDepth<C> {
    const RECORDS: bool = C::RECORDS;

    #[inline(always)]
    fn step(&mut self, node: u32) {
        self.counter.step(node);
    }
    #[inline(always)]
    fn triangles(&mut self, first_slot: impl FnOnce() -> u32, count: u32) {
        self.counter.triangles(first_slot, count);
    }
    #[inline(always)]
    fn alpha(&mut self) {
        self.counter.alpha();
    }
    #[inline(always)]
    fn stacked(&mut self, entries: u32) {
        self.entries = self.entries.max(entries);
    }
}
