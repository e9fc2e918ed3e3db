//! Writing C3D files.

use super::header::Header;
use super::{BLOCK, Processor};
use crate::recording::MarkerRecording;

/// How the numbers are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct C3dFormat {
    /// Byte order and kind of floating point.
    pub processor: Processor,
    /// Kind of the points.
    pub storage: Storage,
    /// The unit of length: `m` or `mm`.
    pub millimetres: bool,
}

/// Kind of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Storage {
    /// 32-bit reals.
    Real,
    /// 16-bit integers; one count is this long, in the file's unit. What is out of their range is written as
    /// missing.
    Integer {
        /// Length of a count.
        scale: f32,
    },
}

impl Default for C3dFormat {
    /// Intel, reals, millimetres: what most programs write.
    fn default() -> Self {
        C3dFormat { processor: Processor::Intel, storage: Storage::Real, millimetres: true }
    }
}

/// The content of a C3D file with the points of a recording and the notes given: parameters `(group, name,
/// text)`.
///
/// Missing points (NaN) get a negative residual. Labels are cut at 127 bytes; texts of notes at 255.
pub fn write_c3d(recording: &MarkerRecording, format: C3dFormat, notes: &[(&str, &str, &str)]) -> Vec<u8> {
    let C3dFormat { processor, storage, millimetres } = format;
    let frames = recording.frames();
    let points = recording.labels.len();
    let scale = match storage {
        Storage::Real => -1.0,
        Storage::Integer { scale } => scale,
    };
    // The number of the data's first block depends on the length of this section: it is filled in at the end.
    let section = |data_block: usize| {
        let mut section = Section::new(processor);
        section.integers("POINT", "USED", &[points as u16]);
        section.reals("POINT", "SCALE", &[scale]);
        section.reals("POINT", "RATE", &[recording.rate_hz as f32]);
        section.integers("POINT", "DATA_START", &[data_block as u16]);
        section.integers("POINT", "FRAMES", &[frames.min(65535) as u16]);
        section.texts("POINT", "UNITS", &[if millimetres { "mm" } else { "m" }]);
        for (number, labels) in recording.labels.chunks(255).enumerate() {
            let name = if number == 0 { "LABELS".to_owned() } else { format!("LABELS{}", number + 1) };
            let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
            section.texts("POINT", &name, &labels);
        }
        section.integers("ANALOG", "USED", &[0]);
        if frames > 65535 {
            section.reals("POINT", "LONG_FRAMES", &[frames as f32]);
            section.integers("TRIAL", "ACTUAL_START_FIELD", &[1, 0]);
            section.integers("TRIAL", "ACTUAL_END_FIELD", &[frames as u16, (frames >> 16) as u16]);
        }
        for &(group, name, text) in notes {
            section.texts(group, name, &[text]);
        }
        section.finish()
    };
    let data_block = 2 + section(0).len() / BLOCK;
    let header = Header {
        points,
        analog: 0,
        first_frame: 1,
        last_frame: frames,
        scale,
        data_block,
        rate_hz: recording.rate_hz as f32,
    };
    let mut file = header.write(processor, 2).to_vec();
    file.extend(section(data_block));
    let per_metre = if millimetres { 1000.0 } else { 1.0 };
    for point in &recording.positions_m {
        write_point(&mut file, point.map(|coordinate| coordinate * per_metre), processor, storage);
    }
    file.resize(file.len().next_multiple_of(BLOCK), 0);
    file
}

fn write_point(file: &mut Vec<u8>, point: [f64; 3], processor: Processor, storage: Storage) {
    let seen = point.iter().all(|coordinate| coordinate.is_finite());
    match storage {
        Storage::Real => {
            for coordinate in point {
                file.extend(processor.write_f32(if seen { coordinate as f32 } else { 0.0 }));
            }
            file.extend(processor.write_f32(if seen { 0.0 } else { -1.0 }));
        }
        Storage::Integer { scale } => {
            let counts = point.map(|coordinate| (coordinate / f64::from(scale)).round());
            let seen = seen && counts.iter().all(|count| count.abs() <= f64::from(i16::MAX));
            for count in counts {
                file.extend(processor.write_i16(if seen { count as i16 } else { 0 }));
            }
            file.extend(processor.write_i16(if seen { 0 } else { -1 }));
        }
    }
}

/// A parameter section that is being written.
struct Section {
    processor: Processor,
    bytes: Vec<u8>,
    groups: Vec<String>,
}

impl Section {
    fn new(processor: Processor) -> Self {
        Section { processor, bytes: vec![1, 0x50, 0, processor.code()], groups: Vec::new() }
    }

    fn integers(&mut self, group: &str, name: &str, values: &[u16]) {
        let data: Vec<u8> = values.iter().flat_map(|&value| self.processor.write_i16(value as i16)).collect();
        self.parameter(group, name, 2, &dimensions(values.len()), &data);
    }

    fn reals(&mut self, group: &str, name: &str, values: &[f32]) {
        let data: Vec<u8> = values.iter().flat_map(|&value| self.processor.write_f32(value)).collect();
        self.parameter(group, name, 4, &dimensions(values.len()), &data);
    }

    fn texts(&mut self, group: &str, name: &str, texts: &[&str]) {
        let length =
            texts.iter().map(|text| text.len()).max().unwrap_or(0).clamp(1, 255).min(if texts.len() > 1 {
                127
            } else {
                255
            });
        let data: Vec<u8> = texts
            .iter()
            .flat_map(|text| {
                let mut bytes = text.as_bytes()[..text.len().min(length)].to_vec();
                bytes.resize(length, b' ');
                bytes
            })
            .collect();
        self.parameter(group, name, -1, &[length as u8, texts.len() as u8], &data);
    }

    fn parameter(&mut self, group: &str, name: &str, kind: i8, dimensions: &[u8], data: &[u8]) {
        let id = self.group(group);
        self.entry(id, name, 2 + dimensions.len() + data.len());
        self.bytes.extend([kind as u8, dimensions.len() as u8]);
        self.bytes.extend(dimensions);
        self.bytes.extend(data);
        self.bytes.push(0);
    }

    /// The number of a group, which is written when it is new.
    fn group(&mut self, name: &str) -> i8 {
        if let Some(index) = self.groups.iter().position(|group| group == name) {
            return index as i8 + 1;
        }
        self.groups.push(name.to_owned());
        let id = self.groups.len() as i8;
        self.entry(-id, name, 0);
        self.bytes.push(0);
        id
    }

    /// Name, group and offset of an entry with `content` bytes, to which the description's length (zero)
    /// comes.
    fn entry(&mut self, id: i8, name: &str, content: usize) {
        self.bytes.extend([name.len() as u8, id as u8]);
        self.bytes.extend(name.as_bytes());
        let offset = (2 + content + 1) as u16;
        self.bytes.extend(self.processor.write_i16(offset as i16));
    }

    /// The section in whole blocks.
    fn finish(mut self) -> Vec<u8> {
        self.bytes.extend([0, 0]);
        self.bytes.resize(self.bytes.len().next_multiple_of(BLOCK), 0);
        self.bytes[2] = (self.bytes.len() / BLOCK).min(255) as u8;
        self.bytes
    }
}

/// A single value has no dimensions.
fn dimensions(length: usize) -> Vec<u8> {
    if length == 1 { Vec::new() } else { vec![length as u8] }
}
