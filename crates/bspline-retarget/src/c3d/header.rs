//! The first block: where things are and how many there are, as far as 16 bits go.

use super::{BLOCK, C3dError, Processor};

/// The header's numbers, as they stand in the file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub points: usize,
    /// Analog numbers in a frame, all channels and subframes.
    pub analog: usize,
    pub first_frame: usize,
    pub last_frame: usize,
    /// Negative: points are reals.
    pub scale: f32,
    /// Block of the data, 1-based.
    pub data_block: usize,
    pub rate_hz: f32,
}

/// Block of the parameter section (1-based), after the mark of the format has been checked.
pub(super) fn parameter_block(bytes: &[u8]) -> Result<u8, C3dError> {
    match bytes.get(..BLOCK) {
        // A short file that is no C3D is reported as no C3D, not as too short.
        _ if bytes.len() >= 2 && bytes[1] != 0x50 => Err(C3dError::NotC3d { found: bytes[1] }),
        Some(block) => Ok(block[0]),
        None => Err(C3dError::Truncated { what: "the header", from: 0, to: BLOCK, length: bytes.len() }),
    }
}

impl Header {
    /// Reads the header of a file whose first block is there.
    pub fn read(bytes: &[u8], processor: Processor) -> Self {
        let at = |word: usize| 2 * (word - 1);
        let count =
            |word: usize| usize::from(processor.read_i16([bytes[at(word)], bytes[at(word) + 1]]) as u16);
        let real = |word: usize| {
            let start = at(word);
            processor.read_f32([bytes[start], bytes[start + 1], bytes[start + 2], bytes[start + 3]])
        };
        Header {
            points: count(2),
            analog: count(3),
            first_frame: count(4),
            last_frame: count(5),
            scale: real(7),
            data_block: count(9),
            rate_hz: real(11),
        }
    }

    /// The header as a block.
    pub fn write(&self, processor: Processor, parameter_block: u8) -> [u8; BLOCK] {
        let mut block = [0; BLOCK];
        block[0] = parameter_block;
        block[1] = 0x50;
        let mut put = |word: usize, bytes: &[u8]| {
            let at = 2 * (word - 1);
            block[at..at + bytes.len()].copy_from_slice(bytes);
        };
        let counts = [
            (2, self.points),
            (3, self.analog),
            (4, self.first_frame),
            (5, self.last_frame),
            (9, self.data_block),
        ];
        for (word, count) in counts {
            // 65535 is what the format holds; longer recordings say so in TRIAL.
            put(word, &processor.write_i16(count.min(65535) as u16 as i16));
        }
        put(7, &processor.write_f32(self.scale));
        put(11, &processor.write_f32(self.rate_hz));
        block
    }
}
