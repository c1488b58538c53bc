//! Handles what a page does on its own: requests of local files, dialogs, downloads.

use super::protocol::{Browser, BrowserError, Event};
use super::serve;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a page did on its own.
#[derive(Debug, Default)]
pub struct PageWatch {
    /// Folder with the files of a local page.
    pub root: Option<PathBuf>,
    /// What the user should know, with the number of times.
    pub remarks: BTreeMap<String, u32>,
    /// Whether frames are being drawn.
    pub draws: bool,
    /// Address of a document that the page loaded while it was drawn.
    pub left_for: Option<String>,
}

impl PageWatch {
    /// Handles an event; returns false for events that are left to the caller.
    ///
    /// # Errors
    /// The browser ended.
    pub fn handle(&mut self, browser: &mut Browser, event: &Event) -> Result<bool, BrowserError> {
        let text = |key: &str| event.params[key].as_str().unwrap_or("");
        match event.method.as_str() {
            "Fetch.requestPaused" => {
                if let Some(root) = &self.root
                    && let Some(refused) = serve::serve(browser, root, &event.params)?
                {
                    self.remark(format!("not served: {refused}"));
                }
            }
            "Page.javascriptDialogOpening" => {
                let kind = text("type");
                // A page that asks whether it may be left is left.
                let accept = json!({ "accept": kind == "beforeunload" });
                browser.notify("Page.handleJavaScriptDialog", accept)?;
                self.remark(format!("dismissed its dialog {kind} {:?}", text("message")));
            }
            "Browser.downloadWillBegin" => {
                self.remark(format!(
                    "refused its download {}",
                    text("suggestedFilename")
                ));
            }
            "Browser.downloadProgress" => {}
            "Inspector.targetCrashed" => {
                return Err(BrowserError::Page("its process crashed".to_owned()));
            }
            "Page.frameNavigated" if self.draws => {
                let frame = &event.params["frame"];
                if frame["parentId"].is_null() {
                    self.left_for = frame["url"].as_str().map(str::to_owned);
                }
            }
            _ => return Ok(self.draws),
        }
        Ok(true)
    }

    fn remark(&mut self, what: String) {
        *self.remarks.entry(what).or_default() += 1;
    }
}
