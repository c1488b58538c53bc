//! Decides from a page's requests when it has loaded.

use super::protocol::Event;
use std::collections::{HashMap, HashSet};
use std::time::{Duration, Instant};

/// A page that requests an address more often than this polls it, and is not waited for.
const MOST_TIMES: u32 = 8;
/// Time after the load event without data of the open requests after which they are not waited for.
const STALLED: Duration = Duration::from_secs(10);
/// Time after the load event after which a page that still requests new addresses is not waited for.
const BUSY: Duration = Duration::from_secs(30);
/// Time before the load event without anything new after which a page is given up.
const SILENT: Duration = Duration::from_secs(45);
/// Documents that a page may load one after the other.
const MOST_DOCUMENTS: u32 = 20;

/// Progress of a page that is loading.
#[derive(Debug)]
pub struct Loading {
    /// When the document had loaded.
    loaded: Option<Instant>,
    /// Open requests and their addresses.
    open: HashMap<String, String>,
    /// Number of requests by address without its query.
    times: HashMap<String, u32>,
    documents: u32,
    /// When something new happened.
    last: Instant,
}

/// Whether a page has loaded.
#[derive(Debug, PartialEq, Eq)]
pub enum State {
    /// No.
    No,
    /// Yes.
    Yes,
    /// Its document has, but requests go on.
    Busy(String),
    /// It never will: it loads documents without end.
    Reloads(u32),
    /// Nothing new has happened for a number of seconds.
    Silent(u64),
}

impl Loading {
    /// A page that starts to load at a time.
    pub fn new(now: Instant) -> Self {
        Self {
            loaded: None,
            open: HashMap::new(),
            times: HashMap::new(),
            documents: 0,
            last: now,
        }
    }

    /// Takes an event into account.
    pub fn take(&mut self, event: &Event, now: Instant) {
        let id = || event.params["requestId"].to_string();
        let is_new = match event.method.as_str() {
            "Page.loadEventFired" => {
                self.loaded = Some(now);
                true
            }
            "Page.frameNavigated" if event.params["frame"]["parentId"].is_null() => {
                self.documents += 1;
                self.loaded = None;
                self.open.clear();
                true
            }
            "Network.requestWillBeSent" => self.request(&event.params, id()),
            "Network.dataReceived" => self.open.contains_key(&id()),
            "Network.loadingFinished" | "Network.loadingFailed" => {
                self.open.remove(&id()).is_some()
            }
            _ => false,
        };
        if is_new {
            self.last = now;
        }
    }

    /// Notes a request; returns false for one that is not waited for.
    fn request(&mut self, params: &serde_json::Value, id: String) -> bool {
        let url = params["request"]["url"].as_str().unwrap_or("");
        // Data URLs are not requested from a server.
        if url.starts_with("data:") || url.starts_with("blob:") {
            return false;
        }
        let address = url.split(['?', '#']).next().unwrap_or(url).to_owned();
        let times = self.times.entry(address.clone()).or_default();
        *times += 1;
        if *times > MOST_TIMES {
            return false;
        }
        self.open.insert(id, address);
        true
    }

    /// Whether the page has loaded, if it counts as loaded after a time without requests.
    pub fn state(&self, now: Instant, settle: Duration) -> State {
        let quiet = now - self.last;
        if self.documents > MOST_DOCUMENTS {
            return State::Reloads(self.documents);
        }
        match self.loaded {
            None if quiet >= SILENT => State::Silent(SILENT.as_secs()),
            None => State::No,
            Some(_) if self.open.is_empty() && quiet >= settle => State::Yes,
            Some(loaded) if quiet >= STALLED.max(settle) || now - loaded >= BUSY.max(settle) => {
                State::Busy(self.detail())
            }
            Some(_) => State::No,
        }
    }

    /// The requests that are open or repeated, for messages; empty without any.
    pub fn detail(&self) -> String {
        let polled = self.times.iter().filter(|(_, times)| **times > MOST_TIMES);
        let polled = polled.map(|(address, times)| format!("{address} ({times} times)"));
        let open: HashSet<&String> = self.open.values().collect();
        let mut all: Vec<String> = open.into_iter().cloned().chain(polled).collect();
        all.sort();
        all.truncate(3);
        match all.as_slice() {
            [] => String::new(),
            some => format!("; requests that go on: {}", some.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    const SETTLE: Duration = Duration::from_secs(1);

    /// States of a page one and 50 seconds after its events, which arrive every 10 ms.
    fn states(events: &[(&str, Value)]) -> [State; 2] {
        let mut now = Instant::now();
        let mut loading = Loading::new(now);
        for (method, params) in events {
            now += Duration::from_millis(10);
            let (method, params) = ((*method).to_owned(), params.clone());
            loading.take(&Event { method, params }, now);
        }
        [1, 50].map(|seconds| loading.state(now + Duration::from_secs(seconds), SETTLE))
    }

    fn request(id: u32, url: &str) -> (&'static str, Value) {
        let params = json!({ "requestId": id.to_string(), "request": { "url": url } });
        ("Network.requestWillBeSent", params)
    }

    fn finished(id: u32) -> (&'static str, Value) {
        (
            "Network.loadingFinished",
            json!({ "requestId": id.to_string() }),
        )
    }

    #[test]
    fn a_page_has_loaded_once_all_requests_are_answered() {
        let load = || ("Page.loadEventFired", json!({}));
        let page = "https://a.test/p";
        let some = [request(1, page), finished(1), load()];
        assert_eq!(states(&some)[0], State::Yes);
        let open = [
            request(1, page),
            finished(1),
            request(2, "https://a.test/data"),
            load(),
        ];
        assert_eq!(states(&open)[0], State::No);
        let [_, State::Busy(text)] = states(&open) else {
            panic!("an open request is waited for");
        };
        assert!(text.contains("https://a.test/data"), "{text}");
        let unloaded = [request(1, page)];
        assert_eq!(states(&unloaded), [State::No, State::Silent(45)]);
    }

    #[test]
    fn polling_is_not_waited_for_and_a_page_that_reloads_is_given_up() {
        let mut polls = vec![request(0, "https://a.test/p"), finished(0)];
        polls.push(("Page.loadEventFired", json!({})));
        for id in 1..500 {
            polls.push(request(id, &format!("https://a.test/x?{id}")));
            polls.push(finished(id));
        }
        assert_eq!(states(&polls)[0], State::Yes);
        let document = json!({ "frame": { "id": "1" } });
        let reloads = vec![("Page.frameNavigated", document); 30];
        assert_eq!(states(&reloads)[0], State::Reloads(30));
    }

    #[test]
    fn a_page_that_requests_new_addresses_without_end_counts_as_loaded() {
        let mut events = vec![("Page.loadEventFired", json!({}))];
        for id in 0..4000 {
            events.push(request(id, &format!("https://a.test/{id}")));
            events.push(finished(id));
        }
        events.push(request(9999, "https://a.test/last"));
        let [State::Busy(text), _] = states(&events) else {
            panic!("waited for");
        };
        assert!(text.contains("a.test/last"), "{text}");
    }
}
