//! `access-av-node`: the localizer on the vehicle, live.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use access_av_node::clock::unix_s;
use access_av_node::engine::{Engine, NodeConfig, Reload};
use access_av_node::inbox::Level;
use access_av_node::playback;
use access_av_node::settings::{NodeSettings, PageSettings};
use access_av_node::sink::{self, Distributor};
use access_av_node::source::{self, Sources};
use access_av_node::state::{self, StateStore};
use access_av_node::statistics::LatencyStats;
use access_av_node::supervisor;
use access_av_node::web::{self, Counters, StatusBoard};
use anyhow::{Context, Result};
use clap::Parser;
use onboard::live::StreamConfig;
use onboard::settings::{Platform, Site, TomlFile, Vehicle};
use recording::load;
use recording::replay::{as_stated, with_phase};
use tokio::signal::unix::{SignalKind, signal};

/// Locates the vehicle from samples and odometry. Writes poses to files, sockets and MQTT, and serves a web page.
#[derive(Clone, Parser)]
#[command(version, about)]
struct Arguments {
    /// Site: a shipped name, or a path.
    #[arg(long)]
    site: String,
    /// Vehicle: a shipped name, or a path.
    #[arg(long)]
    vehicle: String,
    /// Node file: inputs, outputs and page.
    node: PathBuf,
    /// Checks the files, prints missing and implausible settings, and ends.
    #[arg(long)]
    dry_run: bool,
}

fn main() -> ExitCode {
    // The subcommand `schema` has no other arguments.
    let mut arguments = std::env::args().skip(1);
    if arguments.next().as_deref() == Some("schema") {
        return print_schema(&arguments.collect::<Vec<_>>());
    }
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(text) => print_text(&text),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Prints the schema of the node file, or of the outputs.
fn print_schema(arguments: &[String]) -> ExitCode {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => print_text(&NodeSettings::schema_json()),
        ["--outputs"] => print_text(&format!("{:#}", sink::schema())),
        ["--outputs", "--markdown"] => print_text(sink::reference().trim_end()),
        _ => {
            let usage = "usage: access-av-node schema [--outputs [--markdown]]";
            let _ = writeln!(
                std::io::stderr(),
                "error: {arguments:?} is not an option; {usage}"
            );
            ExitCode::from(2)
        }
    }
}

fn print_text(text: &str) -> ExitCode {
    if !text.is_empty() {
        // A closed standard output is not an error.
        let _ = writeln!(std::io::stdout(), "{text}");
    }
    ExitCode::SUCCESS
}

/// Reads a node file. Paths in it are relative to its folder.
fn node_settings(path: &std::path::Path) -> Result<NodeSettings> {
    let origin = path.display().to_string();
    let settings: NodeSettings = load(&origin)?;
    Ok(settings.relative_to(&origin))
}

fn run(arguments: &Arguments) -> Result<String> {
    let settings = node_settings(&arguments.node)?;
    let (site, vehicle, platform) = load_vehicle(arguments)?;
    let antennas = usize::from(vehicle.array.elements);
    let mut sources = Sources::open(&settings, antennas, vehicle.odometer.track_width_m)?;
    let measurand = vehicle.array.measurand();
    for angle in &mut sources.files.angles {
        *angle = with_phase(angle, &measurand);
    }
    let setup = setup_of(&settings, (site, vehicle, platform), sources.stream);
    let live = setup.live()?;
    drop(live);
    if arguments.dry_run {
        return Ok(report(&settings, &setup));
    }
    drive(arguments, &settings, setup, sources)?;
    Ok(String::new())
}

/// Loads site, vehicle and platform.
fn load_vehicle(arguments: &Arguments) -> Result<(Site, Vehicle, Platform)> {
    let site: Site = load(&arguments.site)?;
    let vehicle: Vehicle = load(&arguments.vehicle)?;
    let platform: Platform = load(&vehicle.platform.name)?;
    Ok((site, vehicle, platform))
}

fn setup_of(
    settings: &NodeSettings,
    (site, vehicle, platform): (Site, Vehicle, Platform),
    stream: Option<StreamConfig>,
) -> NodeConfig {
    // The specified standard deviations of logged angles are the total errors.
    let (site, vehicle) = match settings.samples {
        None => as_stated(&site, &vehicle),
        Some(_) => (site, vehicle),
    };
    NodeConfig {
        site,
        vehicle,
        platform,
        stream,
    }
}

/// Creates the request that loads site and vehicle again after SIGHUP.
fn reload(arguments: &Arguments, settings: &NodeSettings, setup: &NodeConfig) -> Reload {
    let (arguments, settings) = (arguments.clone(), settings.clone());
    let (stream, antennas) = (setup.stream, setup.vehicle.array.elements);
    Reload {
        requested: Arc::default(),
        load: Box::new(move || {
            let loaded = load_vehicle(&arguments)?;
            let elements = loaded.1.array.elements;
            if stream.is_some() && elements != antennas {
                anyhow::bail!(
                    "{}: array.elements is {elements}; it must be {antennas}, the number of channels, until the node is \
                     started again",
                    arguments.vehicle
                );
            }
            Ok(setup_of(&settings, loaded, stream))
        }),
    }
}

/// Returns the report of a dry run.
fn report(settings: &NodeSettings, setup: &NodeConfig) -> String {
    let mut lines = Vec::new();
    let (site, vehicle) = (&setup.site, &setup.vehicle);
    if let Some(stream) = setup.stream {
        lines.push(format!(
            "samples: {} of {} antennas, {:.2} Msps at {:.3} MHz; the SSB is at {:.3} MHz",
            settings.samples.as_ref().map_or("", |it| it.name()),
            vehicle.array.elements,
            1e-6 * stream.rate_hz,
            1e-6 * stream.centre_hz,
            site.carrier_mhz,
        ));
    }
    for warning in onboard::plausible::of_site_and_vehicle(site, vehicle) {
        lines.push(format!("warning: {warning}"));
    }
    let outputs = &settings.output;
    let nothing = outputs.json.is_none()
        && outputs.tum.is_none()
        && outputs.mcap.is_none()
        && outputs.mqtt.is_none()
        && settings.page.is_none();
    if nothing {
        lines.push("warning: no [output] and no [page]: the pose is not published".to_owned());
    }
    if vehicle.start.pose.is_none() {
        lines.push("no start.pose: the vehicle searches for its first pose".to_owned());
    }
    lines.push("ready".to_owned());
    lines.join("\n")
}

fn drive(
    arguments: &Arguments,
    settings: &NodeSettings,
    setup: NodeConfig,
    mut sources: Sources,
) -> Result<()> {
    let is_playback = settings.is_playback();
    let monitor = setup.vehicle.integrity_monitor();
    let alert_limit_m = monitor.unwrap_or_default().alert_limit_m;
    let sinks = sink::sinks(&settings.output, &settings.name, alert_limit_m);
    let names: Vec<&str> = sinks.iter().map(|(name, _)| *name).collect();
    let records = Arc::new(Distributor::new(&names, settings.waits()));
    let reload = reload(arguments, settings, &setup);
    let reload_requested = Arc::clone(&reload.requested);
    let fingerprint = state::fingerprint(&setup.site, &setup.vehicle);
    let latency_stats = Arc::new(LatencyStats::default());
    let page_s = settings.page.as_ref().map_or(1.0, |it| 1.0 / it.rate_hz);
    let board = Arc::new(StatusBoard::new(
        &settings.name,
        Duration::from_secs_f64(page_s),
        Counters {
            inbox: Arc::clone(&sources.inbox),
            records: Arc::clone(&records),
            latency_stats: Arc::clone(&latency_stats),
            sources: sources.health.clone(),
            rate_hz: sources.stream.map_or(0.0, |it| it.rate_hz),
        },
    ));
    board.set_site(&setup.site);
    let stop = Arc::new(AtomicBool::new(false));
    let gate = Arc::clone(&sources.gate);
    let mut engine = Engine::new(
        setup,
        Arc::clone(&records),
        Arc::clone(&board),
        latency_stats,
        gate,
        settings.sleep && !is_playback,
    )?;
    if !settings.waits() {
        engine.validate_arrivals();
    }
    if !is_playback {
        engine.reload_by(reload);
    }
    serve(settings.page.as_ref(), &board, &stop, reload_requested)?;
    let writing = sink::start(sinks, &records)?;
    engine.event(Level::Info, "node", format!("{} begins", settings.name));
    for (source, text) in std::mem::take(&mut sources.remarks) {
        engine.event(Level::Warn, source, text);
    }
    let saving = match &settings.state_file {
        Some(file) => {
            let path = PathBuf::from(file);
            let store = Arc::new(StateStore::new(fingerprint.clone()));
            let read = state::read(&path, &fingerprint, unix_s());
            engine.keep_state(Arc::clone(&store), read)?;
            let inbox = Arc::clone(&sources.inbox);
            Some((Arc::clone(&store), state::start(store, path, inbox)?))
        }
        None => None,
    };
    let driven = if is_playback {
        supervisor::ready();
        playback::play(
            &mut engine,
            sources.files,
            &sources.health,
            settings.pace,
            &stop,
        )
    } else {
        source::start(settings, &mut sources)?;
        supervisor::ready();
        let silent_after = Duration::from_secs_f64(settings.silent_after_s);
        let run = engine.run(&sources.inbox, &sources.health, silent_after, &stop);
        run.map_err(Into::into)
    };
    supervisor::stopping();
    engine.report_repeated(true);
    engine.event(Level::Info, "node", format!("{} ends", settings.name));
    if let Some((store, saving)) = saving {
        store.close();
        // A thread that panicked has ended as well.
        let _ = saving.join();
    }
    sources.inbox.close();
    records.close();
    let failed = writing.finish();
    driven?;
    if !failed.is_empty() {
        anyhow::bail!("{}", failed.join("\nerror: "));
    }
    Ok(())
}

/// Serves the web page, if configured, and handles signals in a separate thread.
fn serve(
    page: Option<&PageSettings>,
    board: &Arc<StatusBoard>,
    stop: &Arc<AtomicBool>,
    reload_requested: Arc<AtomicBool>,
) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let listener = match page {
        Some(page) => {
            let listener = runtime.block_on(web::open(page))?;
            let address = listener.local_addr()?;
            let _ = writeln!(std::io::stderr(), "page: http://{address}/");
            Some((listener, page.clone()))
        }
        None => None,
    };
    // Signal handlers are registered first; otherwise a signal would end the process immediately.
    let context = runtime.enter();
    let mut terminated = signal(SignalKind::terminate())?;
    let mut interrupted = signal(SignalKind::interrupt())?;
    let mut hung_up = signal(SignalKind::hangup())?;
    drop(context);
    let (board, stop) = (Arc::clone(board), Arc::clone(stop));
    let work = move || -> Result<()> {
        runtime.block_on(async {
            let reloading = async {
                while hung_up.recv().await.is_some() {
                    reload_requested.store(true, Ordering::Release);
                }
                std::future::pending::<()>().await;
            };
            let serving = async {
                match listener {
                    Some((listener, page)) => web::serve(listener, &page, board).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                _ = terminated.recv() => {}
                _ = interrupted.recv() => {}
                () = reloading => {}
                served = serving => served?,
            }
            stop.store(true, Ordering::Release);
            Ok(())
        })
    };
    let thread = std::thread::Builder::new().name("page".to_owned());
    thread.spawn(move || work().context("page"))?;
    Ok(())
}
