//! What errors say, of bounded length: a file may hold anything, also in the place of a name.

use std::fmt::Display;

use pyo3::pyfunction;

/// Longest message, in characters.
const MOST: usize = 500;

/// [`brief`] for messages that Python makes.
#[pyfunction(name = "brief")]
pub fn brief_text(message: &str) -> String {
    brief(message)
}

/// A message with its middle left out where it is long.
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
