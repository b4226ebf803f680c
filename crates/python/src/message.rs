//! Limited length of error messages, because a file may contain a name of any length.

use std::fmt::Display;

use pyo3::pyfunction;

/// Maximum length of a message in characters.
const MOST: usize = 500;

/// [`brief`] for messages that Python creates.
#[pyfunction(name = "brief")]
pub fn brief_text(message: &str) -> String {
    brief(message)
}

/// Returns the message, with its middle removed if it is too long.
pub fn brief(message: impl Display) -> String {
    let text = message.to_string();
    let length = text.chars().count();
    if length <= MOST {
        return text;
    }
    let head: String = text.chars().take(MOST * 3 / 5).collect();
    let tail: String = text.chars().skip(length - (MOST * 2 / 5 - 3)).collect();
    format!("{head} … {tail}")
}
