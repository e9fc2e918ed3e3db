//! Reading numbers from a message's bytes.

use super::topic::Encoding;

/// Why a message cannot be read.
pub(crate) type Broken = String;

/// A place in a message.
pub(crate) struct Cursor<'a> {
    data: &'a [u8],
    at: usize,
    /// Where alignment counts from.
    origin: usize,
    /// The largest alignment; 1 where there is none.
    alignment: usize,
    little_endian: bool,
    /// Whether strings end with a zero that is counted.
    pub zero_ended: bool,
    /// Whether a message without fields takes a byte.
    pub fills_empty: bool,
}

impl<'a> Cursor<'a> {
    /// # Errors
    /// The bytes do not say how they are laid out, or in a way that is not read.
    pub fn new(data: &'a [u8], encoding: &Encoding) -> Result<Self, Broken> {
        if *encoding != Encoding::Cdr {
            let plain = Cursor {
                data,
                at: 0,
                origin: 0,
                alignment: 1,
                little_endian: true,
                zero_ended: false,
                fills_empty: false,
            };
            return Ok(plain);
        }
        let (little_endian, alignment) = match data {
            [0, 0, _, _, ..] => (false, 8),
            [0, 1, _, _, ..] => (true, 8),
            [0, 6, _, _, ..] => (false, 4),
            [0, 7, _, _, ..] => (true, 4),
            [a, b, _, _, ..] => return Err(format!("its representation is {a:02x}{b:02x}, not plain CDR")),
            _ => return Err("it is shorter than its header".into()),
        };
        Ok(Cursor { data, at: 4, origin: 4, alignment, little_endian, zero_ended: true, fills_empty: true })
    }

    /// The next `size` bytes, aligned to as many.
    fn number<const SIZE: usize>(&mut self) -> Result<[u8; SIZE], Broken> {
        let aligned = SIZE.min(self.alignment);
        let past = (self.at - self.origin) % aligned;
        if past > 0 {
            self.at += aligned - past;
        }
        let bytes = self.bytes(SIZE)?;
        let mut number = [0; SIZE];
        number.copy_from_slice(bytes);
        if !self.little_endian {
            number.reverse();
        }
        Ok(number)
    }

    /// The next bytes as they are.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], Broken> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.data.len());
        let end =
            end.ok_or_else(|| format!("it ends after {} bytes, in the middle of a field", self.data.len()))?;
        let bytes = &self.data[self.at..end];
        self.at = end;
        Ok(bytes)
    }

    /// Bytes that are left.
    pub fn rest(&self) -> usize {
        self.data.len() - self.at
    }

    pub fn unsigned(&mut self, size: u8) -> Result<f64, Broken> {
        Ok(match size {
            1 => f64::from(self.number::<1>()?[0]),
            2 => f64::from(u16::from_le_bytes(self.number()?)),
            4 => f64::from(self.u32()?),
            _ => u64::from_le_bytes(self.number()?) as f64,
        })
    }

    pub fn signed(&mut self, size: u8) -> Result<f64, Broken> {
        Ok(match size {
            1 => f64::from(i8::from_le_bytes(self.number()?)),
            2 => f64::from(i16::from_le_bytes(self.number()?)),
            4 => f64::from(self.i32()?),
            _ => i64::from_le_bytes(self.number()?) as f64,
        })
    }

    pub fn float(&mut self, size: u8) -> Result<f64, Broken> {
        Ok(match size {
            4 => f64::from(f32::from_le_bytes(self.number()?)),
            _ => f64::from_le_bytes(self.number()?),
        })
    }

    pub fn u32(&mut self) -> Result<u32, Broken> {
        Ok(u32::from_le_bytes(self.number()?))
    }

    pub fn i32(&mut self) -> Result<i32, Broken> {
        Ok(i32::from_le_bytes(self.number()?))
    }

    /// A text without the zero at its end.
    pub fn string(&mut self) -> Result<&'a [u8], Broken> {
        let length = self.u32()? as usize;
        let bytes = self.bytes(length)?;
        Ok(match bytes {
            [text @ .., 0] if self.zero_ended => text,
            text => text,
        })
    }

    /// Passes over a text of wide characters.
    pub fn wide_string(&mut self) -> Result<(), Broken> {
        let length = self.u32()? as usize;
        // Implementations write 2 or 4 bytes for each character, and nobody uses the type.
        self.bytes(length.saturating_mul(2)).map(drop)
    }
}
