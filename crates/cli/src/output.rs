//! Writing results: to the terminal, and to files that are whole or not there.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use crate::failure::Failure;

/// Writes text to the standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Failure::Unread),
        Err(error) => Err(Failure::data(format!("the output cannot be written: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Writes a file by way of a temporary one beside it, so that it is never half-written.
pub(crate) fn write_file(path: &Path, content: &[u8]) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let write = || -> io::Result<()> {
        let mut file = tempfile::Builder::new().permissions(readable()).tempfile_in(folder)?;
        file.write_all(content)?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    write().map_err(|error| Failure::unwritten(path, &error))
}

/// Makes a folder for results, with all above it.
pub(crate) fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| Failure::unwritten(path, &error))
}

/// Permissions of a file that others may read, unlike a temporary file's.
#[cfg(unix)]
fn readable() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o644)
}

#[cfg(not(unix))]
fn readable() -> fs::Permissions {
    // Other systems derive permissions from the folder; an ordinary file's will do.
    fs::metadata(".").map(|metadata| metadata.permissions()).expect("the current folder exists")
}
