#![doc = include_str!("../README.md")]

pub mod catalogue;
pub mod trace;

pub use catalogue::{Catalogue, EffectKind, SignalRanges};
