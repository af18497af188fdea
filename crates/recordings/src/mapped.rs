//! The bytes of a file, mapped into memory where it is large: pages that are copied into memory of our own take longer
//! than all that is done with them.

use std::fs::{self, File};
use std::io;
use std::ops::Deref;
use std::path::Path;

use memmap2::Mmap;

/// Bytes from which a file is mapped; smaller ones are read as fast.
const LARGE: u64 = 1 << 20;

/// The bytes of a file.
pub(crate) enum Bytes {
    Mapped(Mmap),
    Read(Vec<u8>),
}

impl Bytes {
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        // Pipes and devices cannot be mapped, nor can files on some file systems.
        let mapped = (metadata.is_file() && metadata.len() >= LARGE).then(|| map(&file));
        match mapped {
            Some(Ok(map)) => Ok(Self::Mapped(map)),
            _ => fs::read(path).map(Self::Read),
        }
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Read(bytes) => bytes,
        }
    }
}

#[expect(unsafe_code, reason = "a map is only as constant as its file, which the system does not warrant")]
fn map(file: &File) -> io::Result<Mmap> {
    // SAFETY: The map is read only, and lives no longer than the reading of one recording. Nobody should write to a
    // recording meanwhile. Whoever does may see a mixture of both read, as without a map; whoever shortens the file ends
    // the program by a signal of the system.
    unsafe { Mmap::map(file) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_and_small_files_give_their_bytes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (size, large) in [(0, false), (5, false), (LARGE, true), (LARGE + 5, true)] {
            let path = folder.path().join("file");
            let content: Vec<u8> = (0..size).map(|at| at.to_le_bytes()[0]).collect();
            fs::write(&path, &content).expect("written");
            let bytes = Bytes::of(&path).expect("there");
            assert_eq!(matches!(bytes, Bytes::Mapped(_)), large);
            assert!(*bytes == content[..], "{size} bytes");
        }
        assert!(Bytes::of(&folder.path().join("absent")).is_err());
    }
}
