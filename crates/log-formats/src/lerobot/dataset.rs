//! A dataset as a table: the frames of all episodes, one after the other.

use super::info::{Info, signal};
use super::leaf::Leaf;
use crate::FormatError;
use crate::arrays::rows::entry_name;
use crate::content_hash::ContentHash;
use crate::table::{Column, Step, Table};
use parquet::basic::Type;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use phiw_limits::Limits;
use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Periods between one episode and the next, for which the log is split there: more than lost frames are,
/// less than what would make a session look long.
const PERIODS_BETWEEN_EPISODES: f64 = 10.0;
/// The same where no rate is known \[s\].
const SECONDS_BETWEEN_EPISODES: f64 = 1.0;

/// The frames of a dataset.
pub(crate) struct DatasetTable {
    path: PathBuf,
    info: Info,
    files: Vec<PathBuf>,
    columns: Vec<Column>,
    features: Vec<Feature>,
    /// Feature and entry of each column; `None` for the time.
    places: Vec<Option<(usize, usize)>>,
    selected: Vec<Option<(usize, usize)>>,
    time: Time,
    frames: u64,
    done: u64,
    /// The next file, and what is read of the present one.
    next_file: usize,
    file: Option<SerializedFileReader<File>>,
    next_group: usize,
    /// Rows left in the group, and its columns, by feature.
    left: i64,
    leaves: HashMap<usize, Leaf>,
    /// The present row, by feature.
    row: Vec<Vec<f64>>,
    hash: ContentHash,
}

/// A column of the files.
struct Feature {
    /// Its name, such as `observation.state`.
    name: String,
    width: usize,
}

/// How the time of a frame comes about.
#[derive(Default)]
struct Time {
    timestamp: Option<usize>,
    frame: Option<usize>,
    episode: Option<usize>,
    current: Option<f64>,
    offset: f64,
    last: f64,
    episodes: u64,
}

impl DatasetTable {
    /// # Errors
    /// A file cannot be read or is damaged.
    pub fn new(path: &Path, files: Vec<PathBuf>, info: Info) -> Result<Self, FormatError> {
        let mut table = DatasetTable {
            path: path.into(),
            frames: info.frames.unwrap_or(0),
            info,
            files,
            columns: Vec::new(),
            features: Vec::new(),
            places: Vec::new(),
            selected: Vec::new(),
            time: Time::default(),
            done: 0,
            next_file: 0,
            file: None,
            next_group: 0,
            left: 0,
            leaves: HashMap::new(),
            row: Vec::new(),
            hash: ContentHash::default(),
        };
        table.find_features()?;
        table.selected = table.places.clone();
        Ok(table)
    }

    /// The features of the first file that has rows.
    fn find_features(&mut self) -> Result<(), FormatError> {
        let first = self.files[0].clone();
        let reader = open(&first)?;
        let rows = reader.metadata().file_metadata().num_rows();
        self.frames = self.frames.max(rows.max(0).cast_unsigned());
        if reader.num_row_groups() == 0 || rows <= 0 {
            return Err(FormatError::Empty { path: first });
        }
        let group = reader.get_row_group(0).map_err(|error| damaged(&first, &error))?;
        let mut time = Time::default();
        for (index, description) in
            reader.metadata().file_metadata().schema_descr().columns().iter().enumerate()
        {
            let is_number = matches!(
                description.physical_type(),
                Type::BOOLEAN | Type::INT32 | Type::INT64 | Type::FLOAT | Type::DOUBLE
            );
            if !is_number || description.max_rep_level() > 1 {
                continue;
            }
            let name = description.path().parts().first().cloned().unwrap_or_default();
            let levels = (description.max_def_level(), description.max_rep_level());
            let width = match levels.1 {
                0 => 1,
                _ => {
                    let column = group.get_column_reader(index).map_err(|error| damaged(&first, &error))?;
                    Leaf::new(column, 1, levels.0, levels.1)
                        .first_width()
                        .map_err(|error| damaged(&first, &error))?
                }
            };
            let feature = self.features.len();
            match name.as_str() {
                "timestamp" => time.timestamp = Some(feature),
                "frame_index" => time.frame = Some(feature),
                "episode_index" => time.episode = Some(feature),
                _ => {}
            }
            self.features.push(Feature { name, width });
        }
        drop(group);
        if time.timestamp.is_some() || (time.frame.is_some() && self.info.fps.is_some()) {
            self.columns.push(Column::named("t"));
            self.places.push(None);
        }
        self.time = time;
        let mut known: Vec<String> = Vec::new();
        for (index, feature) in self.features.iter().enumerate() {
            let names = self.info.names(&feature.name, feature.width);
            for entry in 0..feature.width {
                let named = names.as_ref().map(|names| &names[entry]);
                let signal = named
                    .and_then(|name| signal(&feature.name, name))
                    .filter(|signal| !known.contains(signal));
                known.extend(signal.clone());
                let name = match named {
                    Some(name) if feature.width > 1 => format!("{}.{name}", feature.name),
                    _ => entry_name(&feature.name, feature.width, entry),
                };
                self.columns.push(Column { name, signal });
                self.places.push(Some((index, entry)));
            }
        }
        if self.columns.len() > Limits::default().log_columns {
            let (path, columns) = (self.path.clone(), self.columns.len());
            return Err(FormatError::TooManyColumns { path, header: String::new(), columns });
        }
        Ok(())
    }

    /// Features that are read.
    fn wanted(&self) -> Vec<usize> {
        let mut wanted: Vec<usize> = self.selected.iter().flatten().map(|(feature, _)| *feature).collect();
        if self.selected.contains(&None) {
            let Time { timestamp, frame, episode, .. } = &self.time;
            wanted.extend([timestamp, frame, episode].into_iter().flatten());
        }
        wanted.sort_unstable();
        wanted.dedup();
        wanted
    }

    /// Begins the next group of rows. Returns whether there is one.
    fn next_group(&mut self) -> Result<bool, FormatError> {
        loop {
            if let Some(file) = &self.file
                && self.next_group < file.num_row_groups()
            {
                let path = &self.files[self.next_file - 1];
                let wrong = |error: ParquetError| damaged(path, &error);
                let group = file.get_row_group(self.next_group).map_err(wrong)?;
                self.next_group += 1;
                self.left = group.metadata().num_rows();
                self.leaves.clear();
                let schema = file.metadata().file_metadata().schema_descr();
                for feature in self.wanted() {
                    let Feature { name, width } = &self.features[feature];
                    let mut columns = schema.columns().iter().enumerate();
                    let found = columns.find(|(_, column)| column.path().parts().first() == Some(name));
                    let (index, column) = found
                        .ok_or_else(|| wrong(ParquetError::General(format!("column `{name}` is missing"))))?;
                    let reader = group.get_column_reader(index).map_err(wrong)?;
                    let leaf = Leaf::new(reader, *width, column.max_def_level(), column.max_rep_level());
                    self.leaves.insert(feature, leaf);
                }
                if self.left > 0 {
                    return Ok(true);
                }
                continue;
            }
            let Some(path) = self.files.get(self.next_file) else { return Ok(false) };
            self.file = Some(open(path)?);
            self.next_file += 1;
            self.next_group = 0;
        }
    }

    /// The present frame's time.
    fn seconds(&mut self) -> f64 {
        let value = |feature: Option<usize>| feature.and_then(|feature| self.row[feature].first().copied());
        let of_frames = value(self.time.frame).zip(self.info.fps).map(|(frame, fps)| frame / fps);
        let own = match (value(self.time.timestamp), of_frames) {
            // Stamps are kept in single precision; where they say no more than the frame's number, that is exact.
            (Some(stamp), Some(exact)) if (stamp - exact).abs() <= f64::from(f32::EPSILON) * exact => exact,
            (Some(stamp), _) => stamp,
            (None, exact) => exact.unwrap_or(f64::NAN),
        };
        let episode = value(self.time.episode);
        let between = self.info.fps.map_or(SECONDS_BETWEEN_EPISODES, |fps| PERIODS_BETWEEN_EPISODES / fps);
        let time = &mut self.time;
        if episode != time.current {
            if time.episodes > 0 {
                time.offset = time.last + between - own;
            }
            time.current = episode;
            time.episodes += 1;
        }
        time.last = time.offset + own;
        time.last
    }
}

fn open(path: &Path) -> Result<SerializedFileReader<File>, FormatError> {
    let file = File::open(path).map_err(|source| FormatError::reading(path, source))?;
    SerializedFileReader::new(file).map_err(|error| damaged(path, &error))
}

fn damaged(path: &Path, error: &ParquetError) -> FormatError {
    let what = error.to_string().replace('\n', " ");
    FormatError::Damaged { path: path.into(), format: "Parquet file", what }
}

impl Table for DatasetTable {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        self.selected = columns.iter().map(|&column| self.places[column]).collect();
        self.row = self.features.iter().map(|feature| vec![f64::NAN; feature.width]).collect();
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if self.left == 0 && !self.next_group()? {
            return Ok(Step::End);
        }
        self.left -= 1;
        for (feature, leaf) in &mut self.leaves {
            let row = leaf.row().map_err(|error| {
                let name = &self.features[*feature].name;
                let error = ParquetError::General(format!("column `{name}`: {error}"));
                damaged(&self.files[self.next_file - 1], &error)
            })?;
            self.row[*feature].copy_from_slice(row);
        }
        let seconds = if self.selected.contains(&None) { self.seconds() } else { f64::NAN };
        for (value, place) in values.iter_mut().zip(&self.selected) {
            *value = place.map_or(seconds, |(feature, entry)| self.row[feature][entry]);
        }
        self.done += 1;
        self.hash.row(self.done, values);
        Ok(Step::Row { place: self.done })
    }

    fn progress(&self) -> (u64, u64) {
        (self.done, self.frames.max(self.done))
    }

    fn content_hash(&self) -> u64 {
        self.hash.finish()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "the dataset says nothing of units: positions are taken as rad or m, torques as N·m or N"
                .to_owned(),
        ];
        if self.time.episodes > 1 {
            notes
                .push(format!("{} episodes follow each other, each a stretch by itself", self.time.episodes));
        }
        notes
    }
}
