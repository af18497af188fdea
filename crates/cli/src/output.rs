//! Writing results: to the terminal, and to files that are whole or not there.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use jointscope_report::printable;

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

/// Says something about a file to whoever watches, beside the results.
pub(crate) fn remark(path: &Path, text: &str) {
    // Where nobody reads it, nothing is lost.
    let _ = writeln!(io::stderr(), "{}", printable(&format!("{}: {text}", path.display())));
}

/// Writes files by way of temporary ones beside them, so that none is ever half-written.
pub(crate) fn write_files(files: &[(&Path, &[u8])]) -> Result<(), Failure> {
    let written = files.iter().map(|(path, content)| {
        let file = temporary(path, content).map_err(|error| Failure::unwritten(path, &error))?;
        Ok((path, file))
    });
    // All before the first gets its name: if one cannot be written, none is.
    for (path, file) in written.collect::<Result<Vec<_>, _>>()? {
        file.persist(path).map_err(|error| Failure::unwritten(path, &error.error))?;
    }
    Ok(())
}

fn temporary(path: &Path, content: &[u8]) -> io::Result<tempfile::NamedTempFile> {
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    // Others may read a result, unlike a temporary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(content)?;
    Ok(file)
}

/// Makes the folder that a file is to be in, with all above it.
pub(crate) fn make_folder_of(file: &Path) -> Result<(), Failure> {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Makes a folder for results, with all above it.
pub(crate) fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| Failure::unwritten(path, &error))
}
