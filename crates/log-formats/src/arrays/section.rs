//! Bytes in the middle of a file, unpacked where they are packed and checked as they pass.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// How a section is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SectionPacking {
    Stored,
    Deflate,
    Zlib,
}

/// Where the bytes of an array are.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    pub path: PathBuf,
    pub offset: u64,
    /// Bytes in the file, packed as they are.
    pub length: u64,
    pub packing: SectionPacking,
    /// Bytes before the numbers, unpacked.
    pub skip: u64,
    /// The check sum of all unpacked bytes, where the format has one.
    pub crc: Option<u32>,
}

impl Section {
    /// Reads the numbers' bytes, `ahead` of them passed over.
    pub fn open(&self, ahead: u64) -> io::Result<SectionReader> {
        let mut reader = self.whole()?;
        reader.pass(self.skip + ahead)?;
        Ok(reader)
    }

    /// Reads all unpacked bytes, those before the numbers too.
    pub fn whole(&self) -> io::Result<SectionReader> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.offset))?;
        let packed = BufReader::with_capacity(1 << 16, file).take(self.length);
        let bytes: Box<dyn Read> = match self.packing {
            SectionPacking::Stored => Box::new(packed),
            SectionPacking::Deflate => Box::new(flate2::bufread::DeflateDecoder::new(packed)),
            SectionPacking::Zlib => Box::new(flate2::bufread::ZlibDecoder::new(packed)),
        };
        Ok(SectionReader { bytes, crc: self.crc.map(|crc| (flate2::Crc::new(), crc)) })
    }
}

/// The bytes of a section.
pub(crate) struct SectionReader {
    bytes: Box<dyn Read>,
    crc: Option<(flate2::Crc, u32)>,
}

impl SectionReader {
    /// Reads as many bytes as there is room for.
    pub fn fill(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.read_exact(buffer)
    }

    /// Passes over bytes.
    pub fn pass(&mut self, mut count: u64) -> io::Result<()> {
        let mut buffer = [0; 1 << 13];
        while count > 0 {
            let some = count.min(buffer.len() as u64) as usize;
            self.fill(&mut buffer[..some])?;
            count -= some as u64;
        }
        Ok(())
    }

    /// Reads to the end and compares the check sum.
    pub fn finish(&mut self) -> io::Result<()> {
        let mut buffer = [0; 1 << 13];
        while self.read(&mut buffer)? > 0 {}
        match &self.crc {
            Some((crc, expected)) if crc.sum() != *expected => {
                Err(io::Error::new(io::ErrorKind::InvalidData, "its check sum is wrong"))
            }
            _ => Ok(()),
        }
    }
}

impl Read for SectionReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        if let Some((crc, _)) = &mut self.crc {
            crc.update(&buffer[..count]);
        }
        Ok(count)
    }
}
