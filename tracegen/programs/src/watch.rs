//! Watches the processes of a program for reasons why they do not load the layer.

use spool::FOLDER_VARIABLE;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// First and longest interval between two looks. A program may end soon.
const INTERVALS: [Duration; 2] = [Duration::from_millis(10), Duration::from_secs(1)];

/// Time after which a process that executes a program has its environment.
const EXECUTION: Duration = Duration::from_millis(20);

/// What was seen of the processes that this one started, and of their descendants.
#[derive(Debug)]
pub struct Watch {
    next: Instant,
    interval: Duration,
    /// A process without the environment variables of the capture.
    pub cleared: Option<String>,
    /// Whether a process loaded the Vulkan loader.
    pub vulkan: bool,
    /// Whether a process loaded an OpenGL library.
    pub opengl: bool,
    /// Whether a process loaded the OpenXR loader.
    pub openxr: bool,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            next: Instant::now(),
            interval: INTERVALS[0],
            cleared: None,
            vulkan: false,
            opengl: false,
            openxr: false,
        }
    }
}

impl Watch {
    /// Looks at the processes, unless the last look was a moment ago.
    pub fn look(&mut self) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + self.interval;
        self.interval = (2 * self.interval).min(INTERVALS[1]);
        let own = fs::read_link("/proc/self/exe").ok();
        for process in descendants("self") {
            let folder = Path::new("/proc").join(&process);
            // Before it executes its program, a new process is a copy of this one.
            if fs::read_link(folder.join("exe")).ok() == own {
                continue;
            }
            self.look_at(&folder);
        }
    }

    fn look_at(&mut self, folder: &Path) {
        let maps = fs::read_to_string(folder.join("maps")).unwrap_or_default();
        // A process that has ended has neither maps nor an environment.
        if maps.is_empty() {
            return;
        }
        self.vulkan |= maps.contains("/libvulkan.so");
        self.openxr |= maps.contains("/libopenxr_loader");
        let libraries = ["/libGL.so", "/libGLX.so", "/libEGL.so", "/libOpenGL.so"];
        self.opengl |= libraries.iter().any(|library| maps.contains(library));
        let is_cleared = || {
            let environment = fs::read(folder.join("environ"));
            environment.is_ok_and(|environment| !has_variable(&environment))
        };
        let name = fs::read_to_string(folder.join("comm"));
        // A process that is just executing its program has no environment yet.
        if let Ok(name) = name
            && is_cleared()
            && {
                std::thread::sleep(EXECUTION);
                is_cleared()
            }
            && fs::read(folder.join("maps")).is_ok_and(|maps| !maps.is_empty())
        {
            self.cleared.get_or_insert_with(|| name.trim().to_owned());
        }
    }
}

/// Whether the environment of a process has the variables of a capture.
fn has_variable(environment: &[u8]) -> bool {
    let mut variables = environment.split(|byte| *byte == 0);
    let name = FOLDER_VARIABLE.as_bytes();
    variables.any(|variable| {
        variable
            .strip_prefix(name)
            .is_some_and(|rest| rest.first() == Some(&b'='))
    })
}

/// The processes that a process and its descendants started.
fn descendants(process: &str) -> Vec<String> {
    let threads = fs::read_dir(format!("/proc/{process}/task"));
    let threads = threads.into_iter().flatten().flatten();
    let lists = threads.filter_map(|of| fs::read_to_string(of.path().join("children")).ok());
    let mut found = Vec::new();
    for list in lists {
        for child in list.split_whitespace() {
            found.push(child.to_owned());
            found.extend(descendants(child));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// The process without the variables that a look at a program's process finds.
    fn cleared(command: &mut Command, program: &str) -> Option<String> {
        let mut child = command.spawn().unwrap();
        let folder = Path::new("/proc").join(child.id().to_string());
        let is_started = || {
            let name = fs::read_to_string(folder.join("comm"));
            name.is_ok_and(|name| name.trim() == program)
        };
        while !is_started() {
            std::thread::sleep(Duration::from_millis(5));
        }
        let mut watch = Watch::default();
        watch.look_at(&folder);
        child.kill().unwrap();
        child.wait().unwrap();
        watch.cleared
    }

    #[test]
    fn a_process_with_a_cleared_environment_is_seen() {
        let mut command = Command::new("sleep");
        command.arg("100").env(FOLDER_VARIABLE, "/folder");
        assert_eq!(cleared(&mut command, "sleep"), None);
        command.env_clear();
        assert_eq!(cleared(&mut command, "sleep").as_deref(), Some("sleep"));
    }

    #[test]
    fn processes_that_this_one_started_are_found() {
        let mut child = Command::new("sleep").arg("100").spawn().unwrap();
        assert!(descendants("self").contains(&child.id().to_string()));
        child.kill().unwrap();
        child.wait().unwrap();
    }

    #[test]
    fn the_variable_is_found_by_its_whole_name() {
        let variable = |text: String| has_variable(text.as_bytes());
        assert!(variable(format!("A=1\0{FOLDER_VARIABLE}=/x\0")));
        assert!(!variable(format!("A=1\0{FOLDER_VARIABLE}_2=/x\0")));
        assert!(!variable(String::new()));
    }
}
