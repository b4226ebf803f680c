//! Addresses of inputs and outputs.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Address of an input or output, written as one string.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub enum Address {
    /// `-`: standard input or output.
    Standard,
    /// `tcp://HOST:PORT`: TCP client, which reconnects when the connection ends.
    Tcp(String),
    /// `tcp-listen://HOST:PORT`: TCP server.
    TcpListen(String),
    /// `udp://HOST:PORT`: receives datagrams there, or sends them there.
    Udp(String),
    /// `unix:///PATH`: client of a Unix socket.
    Unix(PathBuf),
    /// `unix-listen:///PATH`: server at a Unix socket.
    UnixListen(PathBuf),
    /// Path of a file.
    File(PathBuf),
}

/// Allowed forms of an address.
pub const FORMS: &str = "it must be `-`, a path, or begin with tcp://, tcp-listen://, udp://, unix:// or \
                         unix-listen://; the first three are followed by HOST:PORT";

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "-" {
            return Ok(Self::Standard);
        }
        let Some((scheme, rest)) = text.split_once("://") else {
            if text.is_empty() {
                return Err(FORMS.to_owned());
            }
            return Ok(Self::File(text.into()));
        };
        let socket = || {
            let port = rest.rsplit_once(':').filter(|(host, _)| !host.is_empty());
            let port = port.and_then(|(_, port)| port.parse::<u16>().ok());
            port.map(|_| rest.to_owned()).ok_or(FORMS.to_owned())
        };
        let path = || match rest {
            "" => Err(FORMS.to_owned()),
            path => Ok(PathBuf::from(path)),
        };
        match scheme {
            "tcp" => socket().map(Self::Tcp),
            "tcp-listen" => socket().map(Self::TcpListen),
            "udp" => socket().map(Self::Udp),
            "unix" => path().map(Self::Unix),
            "unix-listen" => path().map(Self::UnixListen),
            _ => Err(FORMS.to_owned()),
        }
    }
}

impl TryFrom<String> for Address {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Address> for String {
    fn from(address: Address) -> Self {
        address.to_string()
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard => f.write_str("-"),
            Self::Tcp(socket) => write!(f, "tcp://{socket}"),
            Self::TcpListen(socket) => write!(f, "tcp-listen://{socket}"),
            Self::Udp(socket) => write!(f, "udp://{socket}"),
            Self::Unix(path) => write!(f, "unix://{}", path.display()),
            Self::UnixListen(path) => write!(f, "unix-listen://{}", path.display()),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_round_trip_through_text() {
        for text in [
            "-",
            "tcp://127.0.0.1:5000",
            "tcp-listen://localhost:1",
            "udp://[::1]:9",
            "unix:///run/iq",
            "unix-listen:///run/iq",
            "poses.json",
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
        for text in [
            "",
            "tcp://127.0.0.1",
            "tcp://:5",
            "tcp://h:70000",
            "http://h:1",
            "unix://",
        ] {
            assert!(text.parse::<Address>().is_err(), "{text}");
        }
    }
}
