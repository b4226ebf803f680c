//! Inner loops over samples: portable and for the vector instructions of a processor.

#[cfg(any(target_arch = "aarch64", target_arch = "x86_64"))]
mod loops;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
pub(crate) mod real;
#[cfg(target_arch = "x86_64")]
mod x86;
