//! Web server of the page, the events and the metrics. It is read-only: no request changes the
//! node.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use axum::Router;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::routing::get;
use futures_util::{Stream, stream};
use serde_json::json;
use tokio::net::TcpListener;
use tokio::time::sleep;

use super::board::StatusBoard;
use super::metrics;
use crate::settings::PageSettings;

/// Content security policy: nothing is loaded from other servers.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; \
                      img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const PAGE: &str = include_str!("page.html");

#[derive(Clone)]
struct Shared {
    board: Arc<StatusBoard>,
    period: Duration,
}

/// Opens the port of the web page.
///
/// # Errors
/// An error with the key if the port is not available.
pub async fn open(settings: &PageSettings) -> Result<TcpListener> {
    let named = || format!("page.listen is {:?}", settings.listen);
    TcpListener::bind(&settings.listen)
        .await
        .with_context(named)
}

/// Serves until the node stops.
///
/// # Errors
/// Errors of the socket.
pub async fn serve(
    listener: TcpListener,
    settings: &PageSettings,
    board: Arc<StatusBoard>,
) -> Result<()> {
    let shared = Shared {
        board,
        period: Duration::from_secs_f64(1.0 / settings.rate_hz),
    };
    let router = Router::new()
        .route("/", get(page))
        .route(
            "/site.json",
            get(|State(it): State<Shared>| async move { json_text(&it.board.site().json) }),
        )
        .route("/state.json", get(state))
        .route("/events", get(events))
        .route("/metrics", get(prometheus))
        .with_state(shared);
    Ok(axum::serve(listener, router).await?)
}

async fn page() -> impl IntoResponse {
    let headers = [
        (CONTENT_TYPE, "text/html; charset=utf-8"),
        (CONTENT_SECURITY_POLICY, POLICY),
        (CACHE_CONTROL, "no-store"),
    ];
    (headers, PAGE)
}

fn json_text(text: &str) -> impl IntoResponse + use<> {
    let headers = [
        (CONTENT_TYPE, "application/json"),
        (CACHE_CONTROL, "no-store"),
    ];
    (headers, text.to_owned())
}

async fn state(State(shared): State<Shared>) -> impl IntoResponse {
    let mut value = shared.board.to_json();
    value["track_m"] = json!(shared.board.track());
    json_text(&value.to_string())
}

async fn prometheus(State(shared): State<Shared>) -> impl IntoResponse {
    let headers = [(CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")];
    (headers, metrics::text(&shared.board))
}

/// Returns the content of the page at each change.
async fn events(
    State(shared): State<Shared>,
) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let changes = stream::unfold((shared, None), |(shared, last)| async move {
        let mut number = shared.board.number();
        // Also update once per second without a change, because ages are displayed.
        let mut waited = Duration::ZERO;
        while Some(number) == last && waited < Duration::from_secs(1) {
            sleep(shared.period).await;
            waited += shared.period;
            number = shared.board.number();
        }
        if last.is_some() && waited.is_zero() {
            sleep(shared.period).await;
        }
        let event = Event::default().data(shared.board.to_json().to_string());
        Some((Ok(event), (shared, Some(number))))
    });
    Sse::new(changes).keep_alive(KeepAlive::default())
}
