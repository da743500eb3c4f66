//! What tests that draw do where there is no graphics adapter.

/// Says that a test is skipped because of `what`, or fails it where `HLOD_REQUIRE_GPU` is 1.
pub fn skip(what: &str) {
    let required = std::env::var("HLOD_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(!required, "a graphics adapter is required: {what}");
    println!("skipped: {what}");
}

/// What was made, or `None` where that needs an adapter and there is none.
#[allow(dead_code)]
pub fn or_skip<T>(made: hlod::Result<T>) -> Option<T> {
    match made {
        Ok(made) => Some(made),
        Err(hlod::Error::NoAdapter(what)) => {
            skip(&what);
            None
        }
        Err(error) => panic!("{error}"),
    }
}
