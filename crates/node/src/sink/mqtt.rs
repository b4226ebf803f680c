//! The position object of VDA 5050 to an MQTT broker.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};

use super::record::Record;
use super::vda5050::{Localized, position};
use crate::inbox::{Inbox, Input, Level};
use crate::settings::MqttOutput;

const RETRY: Duration = Duration::from_secs(1);
/// Messages that wait for the broker; more are dropped.
const WAITING: usize = 8;

/// A connection to a broker, made again whenever it ends.
pub struct Mqtt {
    client: Client,
    settings: MqttOutput,
    localized: Localized,
    last_s: f64,
}

impl Mqtt {
    /// Begins to connect.
    ///
    /// # Errors
    /// Where the thread cannot be started.
    pub fn new(settings: &MqttOutput, name: &str, inbox: Arc<Inbox>) -> Result<Self> {
        let id = format!("access-av-{name}-{}", std::process::id());
        let mut options = MqttOptions::new(id, settings.host.clone(), settings.port);
        options.set_keep_alive(Duration::from_secs(10));
        let (client, mut connection) = Client::new(options, WAITING);
        let remark = move |level, text| {
            inbox.put(Input::Remark {
                level,
                source: "mqtt",
                text,
            });
        };
        let work = move || {
            let mut said = String::new();
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::ConnAck(_))) => {
                        remark(Level::Info, "connected".to_owned());
                        said.clear();
                    }
                    Ok(_) => {}
                    Err(error) => {
                        let text = error.to_string();
                        if text != said {
                            remark(Level::Warn, text.clone());
                            said = text;
                        }
                        thread::sleep(RETRY);
                    }
                }
            }
        };
        thread::Builder::new().name("mqtt".to_owned()).spawn(work)?;
        Ok(Self {
            client,
            settings: settings.clone(),
            localized: Localized::new(settings),
            last_s: f64::NEG_INFINITY,
        })
    }

    /// Publishes a pose if it is time to. What the broker cannot take now is left out: the next pose is better.
    pub fn take(&mut self, record: &Record) {
        let status = match record {
            Record::Pose(pose) => &pose.status,
            Record::Status { status, .. } => status,
            _ => return,
        };
        let localized = self.localized.judge(status.state, status.time_s);
        let elapsed_s = status.time_s - self.last_s;
        if (0.0..0.99 / self.settings.rate_hz).contains(&elapsed_s) {
            return;
        }
        if let Some(object) = position(status, localized, &self.settings) {
            self.last_s = status.time_s;
            let payload = object.to_string();
            let topic = self.settings.topic.clone();
            let _ = self
                .client
                .try_publish(topic, QoS::AtMostOnce, false, payload);
        }
    }
}
