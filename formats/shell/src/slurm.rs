//! Slurm scripts: a job array of shards, and what follows when all of them are done.

use anyhow::Context;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// Work for a Slurm job array.
#[derive(Clone, Debug)]
pub struct SlurmArray<'a> {
    /// Names the job; what Slurm might stumble over is replaced.
    pub name: &'a str,
    /// Parts.
    pub shards: u32,
    /// Processors of each part; what the cluster gives by itself if none.
    pub cpus: Option<u16>,
    /// Program and arguments, with paths that mean the same on every node.
    pub command: Vec<String>,
    /// Arguments of the job that follows when every part is done; none where no job does.
    pub then: Vec<String>,
}

impl SlurmArray<'_> {
    /// The script. `sh FILE` submits it twice: as the array, and as the job after it, task 0.
    #[must_use]
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
        let cpus = self.cpus.map_or_else(String::new, |cpus| {
            format!("#SBATCH --cpus-per-task={cpus}\n")
        });
        let mut text = format!(
            "#!/bin/sh\n\
             # Work in {shards} shards. Save this as a file and run `sh FILE [OPTIONS OF sbatch]` to submit it. What is done is\n\
             # kept: after a failure run it again.\n\
             #SBATCH --job-name={name}\n\
             #SBATCH --array=1-{shards}\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             {cpus}set -eu\n\
             work() {{\n    {} \"$@\" --threads \"${{SLURM_CPUS_ON_NODE:-1}}\"\n}}\n\
             case \"${{SLURM_ARRAY_TASK_ID-submit}}\" in\n\
             submit)\n\
             \x20   [ -f \"$0\" ] || {{ echo \"save the script, then run: sh FILE\" >&2; exit 2; }}\n\
             \x20   array=$(sbatch --parsable \"$@\" \"$0\")\n\
             \x20   array=${{array%%;*}}\n\
             \x20   echo \"shards: job $array\"\n",
            line(&self.command)
        );
        if !self.then.is_empty() {
            text += "    after=$(sbatch --parsable \"$@\" --array=0 --dependency=\"afterok:$array\" \\\n\
                     \x20       --kill-on-invalid-dep=yes \"$0\")\n\
                     \x20   echo \"after them: job ${after%%;*}\"\n";
        }
        text += "    ;;\n";
        if !self.then.is_empty() {
            let _ = writeln!(text, "0) work {} ;;", line(&self.then));
        }
        let _ = writeln!(
            text,
            "*) work --shard \"$SLURM_ARRAY_TASK_ID/{shards}\" ;;\nesac"
        );
        text
    }
}

/// A path that means the same wherever a script is run.
///
/// # Errors
/// It is empty, or no UTF-8.
pub fn absolute(path: &Path) -> anyhow::Result<String> {
    let place = || path.display().to_string();
    let whole = std::path::absolute(path).with_context(place)?;
    let text = whole.to_str().with_context(place);
    Ok(text
        .context("expected a path in UTF-8 for a script")?
        .to_owned())
}

/// A word as a shell reads it.
#[must_use]
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

    /// What `sh` makes of the script as a task, with `printf` as the program.
    fn told(script: &str, task: &str) -> String {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]).env("SLURM_CPUS_ON_NODE", "3");
        let output = shell.env("SLURM_ARRAY_TASK_ID", task).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    }

    #[test]
    fn words_reach_the_program_as_they_were() {
        let command = ["printf", "[%s]", ODD, ""].map(str::to_owned).to_vec();
        let array = SlurmArray {
            name: "-a b\n#SBATCH --x",
            shards: 7,
            cpus: Some(3),
            command,
            then: vec!["--merge-only".to_owned()],
        };
        let script = array.script();
        assert_eq!(
            told(&script, "5"),
            format!("[{ODD}][][--shard][5/7][--threads][3]")
        );
        assert_eq!(
            told(&script, "0"),
            format!("[{ODD}][][--merge-only][--threads][3]")
        );
        assert!(
            script.contains("\n#SBATCH --job-name=a-b--SBATCH---x\n"),
            "{script}"
        );
        assert!(
            script.contains("\n#SBATCH --array=1-7\n#SBATCH --requeue\n"),
            "{script}"
        );
    }

    #[test]
    fn a_script_that_is_no_file_cannot_submit_itself() {
        let array = SlurmArray {
            name: "a",
            shards: 1,
            cpus: None,
            command: vec!["true".to_owned()],
            then: Vec::new(),
        };
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &array.script()])
            .env_remove("SLURM_ARRAY_TASK_ID");
        let output = shell.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(!array.script().contains("afterok"));
    }
}
