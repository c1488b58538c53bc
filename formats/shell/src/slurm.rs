//! Writes Slurm scripts: a job array of shards, and a job that runs after all of them.

use anyhow::Context;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// Work for a Slurm job array.
#[derive(Clone, Debug)]
pub struct SlurmArray<'a> {
    /// Name of the job; characters that Slurm may reject are replaced.
    pub name: &'a str,
    /// Number of parts.
    pub shards: u32,
    /// Processors per part; the cluster's default if `None`.
    pub cpus: Option<u16>,
    /// Estimated memory and time of the most expensive part; the cluster's default if `None`.
    pub needs: Option<Needs>,
    /// Program and arguments, with paths that are valid on every node.
    pub command: Vec<String>,
    /// Arguments of the job that runs after all parts; empty if there is none.
    pub then: Vec<String>,
}

/// Resources that a part needs, with a margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Memory in MiB.
    pub memory_mib: u64,
    /// Time in minutes.
    pub minutes: u64,
}

/// Submits as many arrays as the cluster's MaxArraySize requires. Task numbers stay below it, and each
/// array's argument is the number of shards before its first one. The default of MaxArraySize is Slurm's
/// 1001. The last job starts when all arrays have ended, even if they failed, and lists missing results.
const SUBMIT: &str = r#"    [ -f "$0" ] || { echo "save the script, then run: sh FILE" >&2; exit 2; }
    most=$(scontrol show config 2>/dev/null | sed -n 's/^MaxArraySize *= *\([0-9][0-9]*\).*/\1/p')
    most=$((${most:-1001} - 1))
    [ "$most" -ge 1 ] || { echo "MaxArraySize: expected at least 2, found $((most + 1))" >&2; exit 2; }
    before=0 arrays=
    while [ "$before" -lt "$shards" ]; do
        count=$((shards - before))
        [ "$count" -le "$most" ] || count=$most
        array=$(sbatch --parsable "$@" --array="1-$count" "$0" "$before")
        array=${array%%;*} arrays=$arrays:${array%%;*}
        echo "job $array: shards $((before + 1)) to $((before + count)) of $shards"
        before=$((before + count))
    done
"#;

/// Submits the last job.
const SUBMIT_AFTER: &str = r#"    after=$(sbatch --parsable "$@" --array=0 --dependency="afterany$arrays" "$0")
    echo "job ${after%%;*}: the merge after them; its log lists what is missing"
"#;

impl SlurmArray<'_> {
    /// The script. `sh FILE` submits it, as arrays and as a last job, which is task 0.
    pub fn script(&self) -> String {
        let name: String = self
            .name
            .chars()
            .map(|c| {
                if c.is_ascii_alphanumeric() || "._".contains(c) {
                    c
                } else {
                    '-'
                }
            })
            .collect();
        let name = name.trim_start_matches('-');
        let line = |words: &[String]| -> String {
            let words: Vec<Cow<str>> = words.iter().map(|word| quoted(word)).collect();
            words.join(" ")
        };
        let shards = self.shards;
        let mut text = format!(
            "#!/bin/sh\n\
             # Work in {shards} shards. Save this as a file and run `sh FILE [OPTIONS OF sbatch]` to submit it. What is done is\n\
             # kept: after a failure run it again.\n\
             #SBATCH --job-name={name}\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n"
        );
        if let Some(cpus) = self.cpus {
            let _ = writeln!(text, "#SBATCH --cpus-per-task={cpus}");
        }
        if let Some(Needs {
            memory_mib,
            minutes,
        }) = self.needs
        {
            let _ = write!(
                text,
                "# Estimated from the plan, with a margin; options of sbatch win.\n\
                 #SBATCH --mem={memory_mib}M\n#SBATCH --time={minutes}\n"
            );
        }
        let _ = write!(
            text,
            "set -eu\nshards={shards}\nwork() {{\n    {} \"$@\" --threads \"${{SLURM_CPUS_ON_NODE:-1}}\"\n}}\n\
             case \"${{SLURM_ARRAY_TASK_ID-submit}}\" in\nsubmit)\n{SUBMIT}",
            line(&self.command)
        );
        if !self.then.is_empty() {
            text += SUBMIT_AFTER;
        }
        text += "    ;;\n";
        if !self.then.is_empty() {
            let _ = writeln!(text, "0) work {} ;;", line(&self.then));
        }
        text += "*) work --shard \"$((SLURM_ARRAY_TASK_ID + ${1:-0}))/$shards\" ;;\nesac\n";
        text
    }
}

/// A path that is valid wherever a script runs.
///
/// # Errors
/// The path is empty or not UTF-8.
pub fn absolute(path: &Path) -> anyhow::Result<String> {
    let place = || path.display().to_string();
    let whole = std::path::absolute(path).with_context(place)?;
    let text = whole.to_str().with_context(place);
    Ok(text
        .context("expected a path in UTF-8 for a script")?
        .to_owned())
}

/// Quotes a word for a shell.
pub fn quoted(word: &str) -> Cow<'_, str> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        Cow::Borrowed(word)
    } else {
        Cow::Owned(format!("'{}'", word.replace('\'', "'\\''")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    const ODD: &str = "a b'c\"$(id)`id`\\\n*%;&|<é";

    /// Output of the script when `sh` runs it as a task, with `printf` as the program.
    fn output_of(script: &str, task: &str) -> String {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]).env("SLURM_CPUS_ON_NODE", "3");
        let output = shell.env("SLURM_ARRAY_TASK_ID", task).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    }

    #[test]
    fn words_reach_the_program_unchanged() {
        let command = ["printf", "[%s]", ODD, ""].map(str::to_owned).to_vec();
        let array = SlurmArray {
            name: "-a b\n#SBATCH --x",
            shards: 7,
            cpus: Some(3),
            needs: Some(Needs {
                memory_mib: 900,
                minutes: 12,
            }),
            command,
            then: vec!["--merge-only".to_owned()],
        };
        let script = array.script();
        assert_eq!(
            output_of(&script, "5"),
            format!("[{ODD}][][--shard][5/7][--threads][3]")
        );
        assert_eq!(
            output_of(&script, "0"),
            format!("[{ODD}][][--merge-only][--threads][3]")
        );
        assert!(
            script.contains("\n#SBATCH --job-name=a-b--SBATCH---x\n"),
            "{script}"
        );
        assert!(
            script.contains("\n#SBATCH --mem=900M\n#SBATCH --time=12\n"),
            "{script}"
        );
    }

    #[cfg(unix)]
    /// Submits a script with an `sbatch` that prints numbers and records its arguments. Returns the output
    /// and those arguments.
    fn submitted(array: &SlurmArray, most: &str) -> (String, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let write = |name: &str, text: &str| {
            use std::os::unix::fs::PermissionsExt;
            std::fs::write(at(name), text).unwrap();
            std::fs::set_permissions(at(name), std::fs::Permissions::from_mode(0o755)).unwrap();
        };
        write(
            "sbatch",
            "#!/bin/sh\necho \"$*\" >> \"${0%/*}/calls\"\necho \"$(wc -l < \"${0%/*}/calls\");cluster\"\n",
        );
        write("scontrol", &format!("#!/bin/sh\n{most}\n"));
        write("job.sh", &array.script());
        let path = std::env::var("PATH").unwrap();
        let output = Command::new("sh")
            .arg(at("job.sh"))
            .arg("--partition=long")
            .env("PATH", format!("{}:{path}", folder.path().display()))
            .env_remove("SLURM_ARRAY_TASK_ID")
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let calls = std::fs::read_to_string(at("calls")).unwrap();
        let job = at("job.sh").display().to_string();
        let calls = calls.lines().map(|line| line.replace(&job, "JOB"));
        (String::from_utf8(output.stdout).unwrap(), calls.collect())
    }

    #[cfg(unix)]
    #[test]
    fn more_shards_than_an_array_may_have_become_several_arrays() {
        let array = |shards| SlurmArray {
            name: "a",
            shards,
            cpus: None,
            needs: None,
            command: vec!["printf".to_owned(), "[%s]".to_owned()],
            then: vec!["--merge-only".to_owned()],
        };
        let (output, calls) = submitted(&array(2000), "exit 1");
        assert_eq!(
            calls,
            [
                "--parsable --partition=long --array=1-1000 JOB 0",
                "--parsable --partition=long --array=1-1000 JOB 1000",
                "--parsable --partition=long --array=0 --dependency=afterany:1:2 JOB",
            ]
        );
        assert!(
            output.contains("job 2: shards 1001 to 2000 of 2000\n"),
            "{output}"
        );
        assert!(output.contains("job 3: the merge"), "{output}");
        let most = "echo 'MaxArraySize            = 4'";
        let (_, calls) = submitted(&array(7), most);
        let numbers = |call: &String| call.split_once("--array=").map(|(_, rest)| rest.to_owned());
        let numbers: Vec<String> = calls.iter().filter_map(numbers).collect();
        assert_eq!(
            numbers,
            [
                "1-3 JOB 0",
                "1-3 JOB 3",
                "1-1 JOB 6",
                "0 --dependency=afterany:1:2:3 JOB"
            ]
        );
        // The second task of the second array.
        let mut shell = Command::new("sh");
        shell.args(["-c", &array(7).script(), "job", "3"]);
        let output = shell.env("SLURM_ARRAY_TASK_ID", "2").output().unwrap();
        let printed = String::from_utf8(output.stdout).unwrap();
        assert_eq!(printed, "[--shard][5/7][--threads][1]");
    }

    #[test]
    fn a_script_that_is_not_a_file_cannot_submit_itself() {
        let array = SlurmArray {
            name: "a",
            shards: 1,
            cpus: None,
            needs: None,
            command: vec!["true".to_owned()],
            then: Vec::new(),
        };
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &array.script()])
            .env_remove("SLURM_ARRAY_TASK_ID");
        let output = shell.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(!array.script().contains("afterany"));
    }
}
