//! Output of the position object of VDA 5050 to an MQTT broker.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use onboard::geometry::Pose;
use rumqttc::{Client, ConnectReturnCode, Connection, Event, LastWill, MqttOptions, Packet, QoS};

use super::output::Sink;
use super::record::Record;
use super::vda5050::{Localized, position};
use crate::settings::MqttOutput;

/// Keep-alive interval. A broker publishes the last will 1.5 intervals after the last packet of a vehicle that has
/// vanished; a broker that hangs is noticed after at most two intervals.
const KEEP_ALIVE: Duration = Duration::from_secs(2);
/// Maximum time to wait for the broker to accept a connection, or to acknowledge the last message.
const PATIENCE: Duration = Duration::from_secs(2);
/// Maximum time without a record, after which the pipeline has ended or hangs, and the vehicle is
/// reported as not localized. A working pipeline provides at least one record per second.
const SILENCE: Duration = Duration::from_millis(1500);
/// Maximum number of messages that wait for the broker. Further messages are dropped, because the
/// next pose is newer.
const CAPACITY: usize = 8;

/// Result of the network thread.
enum Network {
    Connected,
    Acknowledged,
    Failed(String),
}

struct Link {
    client: Client,
    network: Receiver<Network>,
    thread: JoinHandle<()>,
}

/// Positions to an MQTT broker.
pub struct Mqtt {
    client_id: String,
    settings: MqttOutput,
    link: Option<Link>,
    localized: Localized,
    last_s: f64,
    /// Newest pose; the origin of the map before the first one.
    pose: Pose,
    /// Whether the last published message reported the vehicle as localized.
    reported_localized: bool,
    last_record: Instant,
}

impl Mqtt {
    /// Creates the output from the settings; nothing is connected.
    pub fn new(settings: &MqttOutput, node: &str, alert_limit_m: f64) -> Self {
        Self {
            client_id: format!("access-av-{node}-{}", std::process::id()),
            settings: settings.clone(),
            link: None,
            localized: Localized::new(settings, alert_limit_m),
            last_s: f64::NEG_INFINITY,
            pose: Pose::default(),
            reported_localized: false,
            last_record: Instant::now(),
        }
    }

    /// Returns the message that the vehicle is not localized, at its last pose.
    fn not_localized(&self) -> Result<String> {
        let position = position(self.pose, None, false, &self.settings);
        Ok(serde_json::to_string(&position)?)
    }

    fn named(&self) -> String {
        let (host, port) = (&self.settings.host, self.settings.port);
        format!("MQTT broker {host}:{port}")
    }
}

impl Sink for Mqtt {
    fn open(&mut self) -> Result<bool> {
        self.abandon();
        let (host, port) = (self.settings.host.clone(), self.settings.port);
        let mut options = MqttOptions::new(self.client_id.clone(), host, port);
        options.set_keep_alive(KEEP_ALIVE);
        let (topic, will) = (&self.settings.topic, self.not_localized()?);
        options.set_last_will(LastWill::new(topic, will, QoS::AtLeastOnce, true));
        let (client, connection) = Client::new(options, CAPACITY);
        let (sender, network) = mpsc::channel();
        let thread = thread::Builder::new().name("mqtt-network".to_owned());
        let thread = thread.spawn(move || run(connection, &sender))?;
        let link = Link {
            client,
            network,
            thread,
        };
        let answer = link.network.recv_timeout(PATIENCE);
        match answer {
            Ok(Network::Connected) => {}
            Ok(Network::Failed(error)) => return Err(anyhow!(error)).context(self.named()),
            Ok(Network::Acknowledged) | Err(_) => {
                bail!("{}: no answer within {PATIENCE:?}", self.named());
            }
        }
        self.link = Some(link);
        self.last_s = f64::NEG_INFINITY;
        Ok(true)
    }

    fn take(&mut self, record: &Record) -> Result<bool> {
        self.last_record = Instant::now();
        let status = match record {
            Record::Pose(pose) => &pose.status,
            Record::Status { status, .. } => status,
            _ => return Ok(false),
        };
        let localized = self.localized.is_localized(status);
        let Some(pose) = status.pose else {
            return Ok(false);
        };
        self.pose = pose;
        let elapsed_s = status.time_s - self.last_s;
        let is_early = (0.0..0.99 / self.settings.rate_hz).contains(&elapsed_s);
        // The end of localization is published at once.
        let ends = self.reported_localized && !localized;
        if is_early && !ends {
            return Ok(false);
        }
        let level_m = status.protection_level_m;
        let payload = serde_json::to_string(&position(pose, level_m, localized, &self.settings))?;
        let Some(link) = &self.link else {
            return Ok(false);
        };
        let topic = &self.settings.topic;
        let sent = link
            .client
            .try_publish(topic, QoS::AtMostOnce, false, payload);
        if sent.is_ok() {
            (self.last_s, self.reported_localized) = (status.time_s, localized);
        }
        Ok(sent.is_ok())
    }

    fn flush(&mut self) -> Result<bool> {
        let Some(link) = &self.link else {
            return Ok(true);
        };
        while let Ok(event_result) = link.network.try_recv() {
            if let Network::Failed(error) = event_result {
                return Err(anyhow!(error)).context(self.named());
            }
        }
        if link.thread.is_finished() {
            bail!("{}: the connection has ended", self.named());
        }
        if self.reported_localized && self.last_record.elapsed() > SILENCE {
            let payload = self.not_localized()?;
            let topic = &self.settings.topic;
            let sent = link
                .client
                .try_publish(topic, QoS::AtMostOnce, false, payload);
            self.reported_localized = sent.is_err();
            self.localized.reset();
        }
        Ok(true)
    }

    fn abandon(&mut self) {
        // Without its client, the network thread closes the connection, and the broker publishes the last will.
        self.link = None;
        self.reported_localized = false;
        self.localized.reset();
    }

    fn close(&mut self) -> Result<()> {
        let Some(link) = self.link.take() else {
            return Ok(());
        };
        // A broker does not publish the last will of a client that disconnects.
        let payload = self.not_localized()?;
        let topic = &self.settings.topic;
        link.client
            .try_publish(topic, QoS::AtLeastOnce, true, payload)?;
        let due = Instant::now() + PATIENCE;
        loop {
            let left = due.saturating_duration_since(Instant::now());
            match link.network.recv_timeout(left) {
                Ok(Network::Acknowledged) => break,
                Ok(Network::Connected) => {}
                Ok(Network::Failed(error)) => return Err(anyhow!(error)).context(self.named()),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    bail!("{}: the last message was not acknowledged", self.named())
                }
            }
        }
        link.client.try_disconnect()?;
        let due = Instant::now() + PATIENCE;
        while !link.thread.is_finished() && Instant::now() < due {
            thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

/// Runs a connection until it ends.
fn run(mut connection: Connection, sender: &Sender<Network>) {
    for event in connection.iter() {
        let event_result = match event {
            Ok(Event::Incoming(Packet::ConnAck(answer))) => match answer.code {
                ConnectReturnCode::Success => Network::Connected,
                code => Network::Failed(format!("it refuses the connection: {code:?}")),
            },
            Ok(Event::Incoming(Packet::PubAck(_))) => Network::Acknowledged,
            Ok(Event::Outgoing(rumqttc::Outgoing::Disconnect)) => return,
            Ok(_) => continue,
            Err(error) => Network::Failed(error.to_string()),
        };
        let has_failed = matches!(event_result, Network::Failed(_));
        // The receiver is gone once the output was abandoned.
        if sender.send(event_result).is_err() || has_failed {
            return;
        }
    }
}
