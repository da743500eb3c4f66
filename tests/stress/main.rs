//! Inputs that are hard on numbers, over the whole chain: built, verified, and replayed by the
//! model clock. Each must give the figures of a benign twin, or be refused in clear words.
//!
//! One test program with a module for each kind of hardness. With `HLOD_STRESS_TABLE=DIR` each
//! writes its rows there; `scripts/stress` makes a page of them.

#[allow(dead_code)]
#[path = "../e2e/support/mod.rs"]
mod support;

mod blocks;
mod chain;
mod colors;
mod figures;
mod nasty;
mod pictures;
mod places;
mod planes;
mod shape;
mod specks;
mod surfaces;
mod table;
mod views;
