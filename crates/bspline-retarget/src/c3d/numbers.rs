//! Numbers as the three makes of processor write them.

use super::C3dError;

/// Who wrote the numbers of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Processor {
    /// Little-endian, IEEE 754.
    Intel,
    /// Little-endian integers, VAX F floating point.
    Dec,
    /// Big-endian, IEEE 754 (also MIPS).
    Sgi,
}

impl Processor {
    pub(super) fn from_code(found: u8, at: usize) -> Result<Self, C3dError> {
        match found {
            84 => Ok(Processor::Intel),
            85 => Ok(Processor::Dec),
            86 => Ok(Processor::Sgi),
            _ => Err(C3dError::Processor { found, at }),
        }
    }

    pub(super) fn code(self) -> u8 {
        match self {
            Processor::Intel => 84,
            Processor::Dec => 85,
            Processor::Sgi => 86,
        }
    }

    pub(super) fn read_i16(self, bytes: [u8; 2]) -> i16 {
        match self {
            Processor::Sgi => i16::from_be_bytes(bytes),
            _ => i16::from_le_bytes(bytes),
        }
    }

    pub(super) fn write_i16(self, value: i16) -> [u8; 2] {
        match self {
            Processor::Sgi => value.to_be_bytes(),
            _ => value.to_le_bytes(),
        }
    }

    pub(super) fn read_f32(self, bytes: [u8; 4]) -> f32 {
        match self {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Sgi => f32::from_be_bytes(bytes),
            Processor::Dec => {
                // Its 16-bit halves are swapped and its exponent is two higher; exponent zero is the number
                // zero.
                let [a, b, c, d] = bytes;
                let bits = u32::from_le_bytes([c, d, a, b]);
                if bits & 0x7f80_0000 == 0 { 0.0 } else { (f64::from(f32::from_bits(bits)) / 4.0) as f32 }
            }
        }
    }

    pub(super) fn write_f32(self, value: f32) -> [u8; 4] {
        match self {
            Processor::Intel => value.to_le_bytes(),
            Processor::Sgi => value.to_be_bytes(),
            Processor::Dec => {
                let [c, d, a, b] = (value * 4.0).to_le_bytes();
                [a, b, c, d]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vax_numbers_of_the_manual() {
        // VAX F of 1.0 is 0x4080 in the first half, of −1 with the sign bit; 0 has exponent zero whatever its
        // fraction.
        for (bytes, value) in [
            ([0x80, 0x40, 0, 0], 1.0),
            ([0x80, 0xc0, 0, 0], -1.0),
            ([0x48, 0x44, 0, 0], 200.0),
            ([1, 0, 0, 0], 0.0),
        ] {
            assert_eq!(Processor::Dec.read_f32(bytes), value);
        }
        assert_eq!(Processor::Dec.write_f32(1.0), [0x80, 0x40, 0, 0]);
    }
}
