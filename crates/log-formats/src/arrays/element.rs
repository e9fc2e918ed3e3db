//! Types of numbers in arrays.

/// A type of number, little or big endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Element {
    pub kind: ElementKind,
    pub bytes: usize,
    pub big_endian: bool,
}

/// Kinds of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ElementKind {
    Float,
    Signed,
    Unsigned,
}

impl Element {
    /// The number in `bytes`, as many as the element has.
    pub fn value(&self, bytes: &[u8]) -> f64 {
        let mut number = [0; 8];
        let number_bytes = &mut number[..self.bytes];
        number_bytes.copy_from_slice(bytes);
        if self.big_endian {
            number_bytes.reverse();
        }
        let unsigned = u64::from_le_bytes(number);
        let shift = 64 - 8 * self.bytes as u32;
        match self.kind {
            ElementKind::Float => match self.bytes {
                2 => half(unsigned as u16),
                4 => f64::from(f32::from_bits(unsigned as u32)),
                _ => f64::from_bits(unsigned),
            },
            ElementKind::Signed => ((unsigned << shift).cast_signed() >> shift) as f64,
            ElementKind::Unsigned => unsigned as f64,
        }
    }
}

/// IEEE 754's number of 16 bits.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    sign * match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_sizes() {
        let check = |kind, bytes: &[u8], expected: f64| {
            let mut element = Element { kind, bytes: bytes.len(), big_endian: false };
            assert_eq!(element.value(bytes), expected, "{bytes:?}");
            element.big_endian = true;
            let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!(element.value(&reversed), expected, "{bytes:?}");
        };
        check(ElementKind::Signed, &(-2i8).to_le_bytes(), -2.0);
        check(ElementKind::Signed, &(-300i16).to_le_bytes(), -300.0);
        check(ElementKind::Signed, &i64::MIN.to_le_bytes(), i64::MIN as f64);
        check(ElementKind::Unsigned, &[200], 200.0);
        check(ElementKind::Unsigned, &4_000_000_000u32.to_le_bytes(), 4e9);
        check(ElementKind::Float, &0.1f32.to_le_bytes(), f64::from(0.1f32));
        check(ElementKind::Float, &0.1f64.to_le_bytes(), 0.1);
        // 1, the largest and the smallest half.
        check(ElementKind::Float, &0x3c00u16.to_le_bytes(), 1.0);
        check(ElementKind::Float, &0xfbffu16.to_le_bytes(), -65504.0);
        check(ElementKind::Float, &1u16.to_le_bytes(), 2f64.powi(-24));
    }
}
