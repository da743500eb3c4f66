//! The ways of choosing levels of detail, one module each.

pub mod lakhia;
