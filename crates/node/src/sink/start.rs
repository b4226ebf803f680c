//! Opens all sinks, and writes to them on a thread of their own.

use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, Result};

use super::json::Json;
use super::mcap::Mcap;
use super::mqtt::Mqtt;
use super::queue::Queue;
use super::record::Record;
use super::tum::Tum;
use crate::inbox::Inbox;
use crate::settings::Outputs;

/// What is written is sent to the disk this often at least.
const FLUSH: Duration = Duration::from_millis(200);

/// All sinks that the settings name.
#[derive(Default)]
pub struct Sinks {
    json: Option<Json>,
    tum: Option<Tum>,
    mcap: Option<Mcap>,
    mqtt: Option<Mqtt>,
}

impl Sinks {
    /// Opens them.
    ///
    /// # Errors
    /// What is wrong with one of them.
    pub fn open(settings: &Outputs, name: &str, inbox: &Arc<Inbox>) -> Result<Self> {
        let connect = |mqtt| Mqtt::new(mqtt, name, Arc::clone(inbox));
        Ok(Self {
            json: settings.json.as_ref().map(Json::new).transpose()?,
            tum: settings.tum.as_deref().map(Tum::new).transpose()?,
            mcap: settings.mcap.as_ref().map(Mcap::new).transpose()?,
            mqtt: settings.mqtt.as_ref().map(connect).transpose()?,
        })
    }

    fn take(&mut self, record: &Record) -> Result<()> {
        if let Some(json) = &mut self.json {
            json.take(record).context("output.json")?;
        }
        if let Some(tum) = &mut self.tum {
            tum.take(record).context("output.tum")?;
        }
        if let Some(mcap) = &mut self.mcap {
            mcap.take(record).context("output.mcap")?;
        }
        if let Some(mqtt) = &mut self.mqtt {
            mqtt.take(record);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        if let Some(json) = &mut self.json {
            json.flush().context("output.json")?;
        }
        if let Some(tum) = &mut self.tum {
            tum.flush().context("output.tum")?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        if let Some(mcap) = &mut self.mcap {
            mcap.finish().context("output.mcap")?;
        }
        self.flush()
    }
}

/// Writes all records until the queue is closed; then every file is whole.
///
/// # Errors
/// Where the thread cannot be started.
pub fn start(mut sinks: Sinks, records: Arc<Queue>) -> Result<JoinHandle<Result<()>>> {
    let write = move || {
        let mut taken = VecDeque::new();
        while records.take(FLUSH, &mut taken) {
            for record in taken.drain(..) {
                sinks.take(&record)?;
            }
            sinks.flush()?;
        }
        sinks.finish()
    };
    Ok(thread::Builder::new()
        .name("sinks".to_owned())
        .spawn(write)?)
}
