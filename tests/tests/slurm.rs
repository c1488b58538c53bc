//! Runs a sweep on a real Slurm cluster of two nodes, which exists on the loopback interface during the
//! test. Skipped, with a line, if Slurm is absent or the user may not run its daemons.

use parallax_tests::{program, root, run_ok};
use std::fs::{self, File};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const PROGRAMS: [&str; 7] = [
    "munged",
    "slurmctld",
    "slurmd",
    "sbatch",
    "squeue",
    "scancel",
    "scontrol",
];

/// Longest wait for anything.
const LONGEST_WAIT: Duration = Duration::from_secs(100);

fn find(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin", "/sbin"].map(PathBuf::from));
    let mut found = folders.map(|folder| folder.join(program));
    found.find(|path| path.is_file())
}

/// The reason why no cluster can run here, if any.
fn missing_requirement() -> Option<String> {
    if let Some(program) = PROGRAMS.iter().find(|program| find(program).is_none()) {
        return Some(format!("{program} is absent"));
    }
    let user = Command::new("id").arg("-u").output();
    let is_root = user.is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    (!is_root).then(|| "slurmd needs root".to_owned())
}

/// Waits until a condition holds; returns false after [`LONGEST_WAIT`].
fn wait_for(mut holds: impl FnMut() -> bool) -> bool {
    let deadline = Instant::now() + LONGEST_WAIT;
    while !holds() {
        if Instant::now() > deadline {
            return false;
        }
        sleep(Duration::from_millis(50));
    }
    true
}

/// Two nodes and their controller; dropping it ends all daemons.
struct Cluster {
    folder: tempfile::TempDir,
    ports: [u16; 3],
    daemons: Vec<Child>,
}

impl Cluster {
    fn start() -> Self {
        // Held at the same time, so that they differ.
        let free = [(); 3].map(|()| TcpListener::bind("127.0.0.1:0").expect("a free port"));
        let ports = free
            .each_ref()
            .map(|l| l.local_addr().expect("an address").port());
        drop(free);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut cluster = Self {
            folder,
            ports,
            daemons: Vec::new(),
        };
        cluster.configure();
        let at = |name: &str| cluster.path(name).display().to_string();
        let munged = [
            "--foreground",
            "--force",
            "--key-file",
            &at("munge/key"),
            "--socket",
            &at("munge/socket"),
            "--pid-file",
            &at("munge/pid"),
            "--log-file",
            &at("munge/log"),
            "--seed-file",
            &at("munge/seed"),
        ]
        .map(str::to_owned);
        cluster.daemon("munged", &munged);
        assert!(
            wait_for(|| cluster.path("munge/socket").exists()),
            "no munged"
        );
        cluster.daemon("slurmctld", &["-D".to_owned()]);
        for node in ["n1", "n2"] {
            cluster.daemon("slurmd", &["-D", "-N", node].map(str::to_owned));
        }
        let idle = || {
            cluster
                .output_of("sinfo", &["-h", "-t", "idle", "-o", "%D"])
                .trim()
                == "2"
        };
        assert!(wait_for(idle), "no two idle nodes:\n{}", cluster.logs());
        cluster
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn configure(&self) {
        for folder in ["munge", "state", "spool/n1", "spool/n2"] {
            fs::create_dir_all(self.path(folder)).expect("a folder");
        }
        let key = self.path("munge/key");
        fs::write(&key, [7u8; 1024]).expect("a key");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |mode| fs::Permissions::from_mode(mode);
            fs::set_permissions(&key, mode(0o600)).expect("a mode");
            fs::set_permissions(self.path("munge"), mode(0o755)).expect("a mode");
            fs::set_permissions(self.folder.path(), mode(0o755)).expect("a mode");
        }
        let host = fs::read_to_string("/proc/sys/kernel/hostname").expect("a host name");
        let (host, folder) = (host.trim(), self.folder.path().display());
        let [controller, first, second] = self.ports;
        let node = |name, port| {
            format!(
                "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 RealMemory=4000\n"
            )
        };
        let text = format!(
            "ClusterName=parallax\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={controller}\n\
             CommunicationParameters=NoInAddrAny,NoCtldInAddrAny\nSlurmUser=root\nAuthType=auth/munge\n\
             AuthInfo=socket={folder}/munge/socket,cred_expire=5\nProctrackType=proctrack/linuxproc\n\
             TaskPlugin=task/none\nMpiDefault=none\nJobAcctGatherType=jobacct_gather/none\n\
             AccountingStorageType=accounting_storage/none\nSelectType=select/cons_tres\n\
             SelectTypeParameters=CR_Core\nMaxArraySize=4\nReturnToService=2\nSlurmdTimeout=10\n\
             StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool/%n\n\
             SlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd-%n.pid\n\
             SlurmctldLogFile={folder}/slurmctld.log\nSlurmdLogFile={folder}/slurmd-%n.log\n{}{}\
             PartitionName=all Nodes=n1,n2 Default=YES State=UP\n",
            node("n1", first),
            node("n2", second),
        );
        fs::write(self.path("slurm.conf"), text).expect("a configuration");
        // The only choice that does not need a mounted cgroup.
        fs::write(self.path("cgroup.conf"), "CgroupPlugin=cgroup/v1\n").expect("a configuration");
    }

    fn command(&self, program: &str) -> Command {
        let path = find(program).unwrap_or_else(|| program.into());
        let mut command = Command::new(path);
        let inherited = std::env::vars().filter(|(name, _)| name.starts_with("SLURM_"));
        for (name, _) in inherited {
            command.env_remove(name);
        }
        command
            .env("SLURM_CONF", self.path("slurm.conf"))
            .current_dir(self.folder.path());
        command
    }

    fn daemon(&mut self, program: &str, arguments: &[String]) {
        let log = File::create(self.path(&format!("{program}-{}.out", self.daemons.len())))
            .expect("a log");
        let mut command = self.command(program);
        command
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        self.daemons
            .push(command.spawn().expect("the daemon starts"));
    }

    /// Output of a command; empty if it fails.
    fn output_of(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.command(program).args(arguments).output();
        output.map_or_else(
            |_| String::new(),
            |o| String::from_utf8_lossy(&o.stdout).into_owned(),
        )
    }

    fn jobs(&self) -> String {
        self.output_of("squeue", &["--noheader", "--array", "--format", "%i %T"])
    }

    /// Submits a script with `sh`; returns its output.
    fn submit(&self, script: &Path) -> String {
        let output: Output = run_ok(self.command("sh").arg(script));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn wait_for_jobs(&self) {
        assert!(
            wait_for(|| self.jobs().trim().is_empty()),
            "jobs do not end:\n{}\n{}",
            self.jobs(),
            self.logs()
        );
    }

    fn logs(&self) -> String {
        let entries = fs::read_dir(self.folder.path())
            .expect("the folder")
            .flatten();
        let mut text = String::new();
        for path in entries.map(|e| e.path()).filter(|p| p.is_file()) {
            if path.extension().is_some_and(|e| e == "out" || e == "log") {
                let log = fs::read(&path).unwrap_or_default();
                text += &format!("== {}\n{}", path.display(), String::from_utf8_lossy(&log));
            }
        }
        text
    }

    /// Local addresses, in the system's notation, that listen on the daemons' ports.
    fn listeners(&self) -> Vec<String> {
        let mut found = Vec::new();
        for table in ["/proc/net/tcp", "/proc/net/tcp6"] {
            let text = fs::read_to_string(table).unwrap_or_default();
            for line in text.lines().skip(1) {
                let fields: Vec<&str> = line.split_whitespace().collect();
                let [_, local, _, "0A", ..] = fields[..] else {
                    continue;
                };
                let Some((address, port)) = local.split_once(':') else {
                    continue;
                };
                if u16::from_str_radix(port, 16).is_ok_and(|port| self.ports.contains(&port)) {
                    found.push(address.to_owned());
                }
            }
        }
        found
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // Jobs first, because their processes are not children of this one.
        if !self.jobs().trim().is_empty() {
            self.output_of("scancel", &["--full", "--user", "root"]);
            wait_for(|| self.jobs().trim().is_empty());
        }
        for mut daemon in self.daemons.drain(..).rev() {
            // SIGTERM ends them in order; SIGKILL ends those that do not react.
            let _sent = Command::new("kill").arg(daemon.id().to_string()).status();
            let deadline = Instant::now() + Duration::from_secs(5);
            while matches!(daemon.try_wait(), Ok(None)) && Instant::now() < deadline {
                sleep(Duration::from_millis(20));
            }
            let _killed = daemon.kill();
            let _ended = daemon.wait();
        }
    }
}

const EXPERIMENT: &str = "\
[axes]
order = [\"morton\", \"hilbert\", \"z2-sta\"]
l1.size_bytes = [\"4KiB\", \"8KiB\", \"16KiB\"]
l2.replacement = [\"lru\", \"fifo\"]
";

#[test]
fn a_job_array_on_two_nodes_has_the_bytes_of_one_machine_also_after_a_task_was_killed() {
    if let Some(missing_requirement) = missing_requirement() {
        parallax_tests::skipped!("{missing_requirement}");
        return;
    }
    let cluster = Cluster::start();
    let listeners = cluster.listeners();
    assert_eq!(
        listeners, ["0100007F"; 3],
        "daemons listen on loopback alone"
    );

    let experiment = cluster.path("sweep.toml");
    fs::write(&experiment, EXPERIMENT).expect("an experiment");
    let sweep = |out: &str| {
        let mut command = program("replay");
        command.arg("sweep").arg(&experiment);
        command.arg(root().join("traces/atrium-shadows.textrace"));
        command.arg("--out").arg(cluster.path(out));
        command
    };
    let read = |out: &str, name: &str| fs::read(cluster.path(out).join(name));
    run_ok(&mut sweep("one"));
    let same = |out: &str| {
        for name in ["results.json", "results.csv", "report.html"] {
            let merged =
                read(out, name).unwrap_or_else(|e| panic!("{name}: {e}\n{}", cluster.logs()));
            assert!(
                merged == read("one", name).expect("a result"),
                "{out}: {name} differs"
            );
        }
    };

    let script = |out: &str| {
        let text = run_ok(sweep(out).args(["--emit-slurm", "4"])).stdout;
        let path = cluster.path(&format!("{out}.sh"));
        fs::write(&path, text).expect("a script");
        path
    };
    let submitted = cluster.submit(&script("array"));
    assert!(
        submitted.starts_with("job ") && submitted.contains("the merge after them"),
        "{submitted}"
    );
    cluster.wait_for_jobs();
    same("array");

    // A task is killed as the kernel does when memory is exhausted; the merge after it lists what is
    // missing. A task that had already written its shard causes no missing points, so another sweep is
    // tried.
    let (out, path, submitted) = (0..5)
        .find_map(|attempt| {
            let out = format!("killed-{attempt}");
            let path = script(&out);
            let submitted = cluster.submit(&path);
            kill_a_task(&cluster, &submitted);
            cluster.wait_for_jobs();
            read(&out, "results.json")
                .is_err()
                .then_some((out, path, submitted))
        })
        .expect("a task killed before its shard was written");
    let after: Vec<&str> = submitted
        .lines()
        .filter_map(|l| l.split(':').next())
        .collect();
    let after = after.last().and_then(|job| job.strip_prefix("job "));
    let log = cluster.path(&format!("slurm-{}_0.out", after.unwrap_or_default()));
    let log = fs::read_to_string(log).expect("the merge's log");
    assert!(log.contains("of 18 points are missing"), "{log}");
    let merge = sweep(&out)
        .arg("--merge-only")
        .output()
        .expect("replay starts");
    let message = String::from_utf8_lossy(&merge.stderr).into_owned();
    assert!(
        merge.status.code() == Some(2) && message.contains("of 18 points are missing"),
        "{message}"
    );
    // The same script replays the missing points.
    cluster.submit(&path);
    cluster.wait_for_jobs();
    same(&out);
}

/// Kills the processes of a running task of the array that `submitted` names.
fn kill_a_task(cluster: &Cluster, submitted: &str) {
    let array: String = submitted
        .chars()
        .skip_while(|c| !c.is_ascii_digit())
        .take_while(char::is_ascii_digit)
        .collect();
    let killed = wait_for(|| {
        let pids = cluster.output_of(
            "squeue",
            &[
                "--noheader",
                "--array",
                "--jobs",
                &array,
                "--states",
                "R",
                "--format",
                "%A %N",
            ],
        );
        pids.lines().any(|line| {
            let Some((job, node)) = line.split_once(' ') else {
                return false;
            };
            let listed = cluster
                .command("scontrol")
                .args(["listpids", job, node.trim()])
                .output();
            let listed = listed
                .map(|o| String::from_utf8_lossy(&o.stdout).into_owned())
                .unwrap_or_default();
            let pids: Vec<&str> = listed
                .lines()
                .skip(1)
                .filter_map(|l| l.split_whitespace().next())
                .filter(|p| *p != "-1")
                .collect();
            !pids.is_empty()
                && Command::new("kill")
                    .arg("-9")
                    .args(&pids)
                    .stderr(Stdio::null())
                    .status()
                    .is_ok_and(|s| s.success())
        })
    });
    assert!(killed, "no task to kill:\n{}", cluster.logs());
}
