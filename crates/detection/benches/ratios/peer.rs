//! Peers outside this program, which time themselves around their kernels.
//!
//! A peer is a process that reads the workload from a folder, says `ready`, and then for every line that names a kernel
//! answers with one line: the seconds that the kernel took, then numbers of its result.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Where the peers' sources are.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers");

pub(crate) struct Peer {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    /// A script for `python3`, with the folder of its workload.
    pub(crate) fn python(script: &str, folder: &Path) -> Result<Self, String> {
        let mut command = Command::new("python3");
        command.arg(Path::new(SOURCES).join(script)).arg(folder);
        Self::start(command).map_err(|error| format!("{script} ({error})"))
    }

    /// A C++ program, compiled into the folder of its workload.
    pub(crate) fn cpp(source: &str, folder: &Path) -> Result<Self, String> {
        let program: PathBuf = folder.join("peer");
        let compiled = Command::new("c++")
            .args(["-O3", "-march=native", "-I/usr/include/eigen3", "-o"])
            .arg(&program)
            .arg(Path::new(SOURCES).join(source))
            .stderr(Stdio::null())
            .status();
        if !compiled.is_ok_and(|status| status.success()) {
            return Err(format!("{source} (does not compile here)"));
        }
        let mut command = Command::new(program);
        command.arg(folder);
        Self::start(command).map_err(|error| format!("{source} ({error})"))
    }

    fn start(mut command: Command) -> Result<Self, String> {
        command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1").stderr(Stdio::null());
        let started = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut process = started.map_err(|error| error.to_string())?;
        let pipes = process.stdin.take().zip(process.stdout.take());
        let (requests, answers) = pipes.ok_or("no pipes")?;
        let mut peer = Self { process, requests, answers: BufReader::new(answers) };
        match peer.line() {
            Some(line) if line == "ready" => Ok(peer),
            _ => Err("what it needs is absent".into()),
        }
    }

    fn line(&mut self) -> Option<String> {
        let mut line = String::new();
        self.answers.read_line(&mut line).ok().filter(|length| *length > 0)?;
        Some(line.trim().to_owned())
    }

    /// Seconds of a kernel, and numbers of its result; `None` if the peer lacks it.
    pub(crate) fn run(&mut self, kernel: &str) -> Option<(f64, Vec<f64>)> {
        writeln!(self.requests, "{kernel}").ok()?;
        self.requests.flush().ok()?;
        let numbers: Option<Vec<f64>> = self.line()?.split_whitespace().map(|word| word.parse().ok()).collect();
        let mut numbers = numbers?.into_iter();
        Some((numbers.next()?, numbers.collect()))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It ends with its requests; a peer that does not is ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Writes numbers as peers read them: little-endian, one after another.
pub(crate) fn write_numbers(path: &Path, numbers: &[f64]) {
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    fs::write(path, bytes).expect("the folder of temporary files can be written");
}
