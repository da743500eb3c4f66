//! The module as a whole: what is drawn from a node is what the source has there.
