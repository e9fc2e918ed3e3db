//! The number that a kernel runs on: one sample (`f64`), a SIMD register of samples
//! ([`Lanes`]), or a value with its derivative ([`Dual`]).

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What the dynamics kernels ask of a number.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The constant `value`: the same in every lane, with derivative zero.
    fn constant(value: f64) -> Self;
    /// Sine and cosine, angle in rad.
    fn sin_cos(self) -> (Self, Self);
    /// Zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// One.
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
}

/// `N` samples side by side, one per lane of a SIMD register.
///
/// A plain array: the compiler turns its element-wise operations into vector instructions when
/// the caller enables them (4 lanes for AVX2, 8 for AVX-512).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const N: usize>(pub [f64; N]);

/// A value and its derivative along one direction, or along several side by side where `D` is [`Lanes`]
/// (forward-mode differentiation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<D = f64> {
    /// The value.
    pub value: f64,
    /// Its derivative.
    pub derivative: D,
}

macro_rules! lanes_operator {
    ($operator:ident, $method:ident, $assign:tt) => {
        impl<const N: usize> $operator for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for lane in 0..N {
                    self.0[lane] $assign other.0[lane];
                }
                self
            }
        }
    };
}
lanes_operator!(Add, add, +=);
lanes_operator!(Sub, sub, -=);
lanes_operator!(Mul, mul, *=);
lanes_operator!(Div, div, /=);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in 0..N {
            self.0[lane] = -self.0[lane];
        }
        self
    }
}

impl<const N: usize> Scalar for Lanes<N> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Lanes([value; N])
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (mut sine, mut cosine) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            (sine[lane], cosine[lane]) = self.0[lane].sin_cos();
        }
        (Lanes(sine), Lanes(cosine))
    }
}

impl Dual {
    /// The variable of differentiation: derivative one.
    pub fn variable(value: f64) -> Self {
        Dual { value, derivative: 1.0 }
    }
}
impl<D: Scalar> Add for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Dual { value: self.value + other.value, derivative: self.derivative + other.derivative }
    }
}
impl<D: Scalar> Sub for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Dual { value: self.value - other.value, derivative: self.derivative - other.derivative }
    }
}
impl<D: Scalar> Mul for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Dual {
            value: self.value * other.value,
            derivative: self.derivative * D::constant(other.value)
                + D::constant(self.value) * other.derivative,
        }
    }
}
impl<D: Scalar> Div for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let rest = self.derivative - D::constant(value) * other.derivative;
        Dual { value, derivative: rest / D::constant(other.value) }
    }
}
impl<D: Scalar> Neg for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual { value: -self.value, derivative: -self.derivative }
    }
}
impl<D: Scalar> Scalar for Dual<D> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Dual { value, derivative: D::zero() }
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (
            Dual { value: sine, derivative: D::constant(cosine) * self.derivative },
            Dual { value: cosine, derivative: D::constant(-sine) * self.derivative },
        )
    }
}

macro_rules! assigning_operators {
    ($([$($generics:tt)*] $kind:ty),*) => {$(
        impl<$($generics)*> AddAssign for $kind {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
        impl<$($generics)*> SubAssign for $kind {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    )*};
}
assigning_operators!([const N: usize] Lanes<N>, [D: Scalar] Dual<D>);
