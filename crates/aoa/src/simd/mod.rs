//! What loops need to become vector code: a choice by processor, and functions without branches.

pub(crate) mod instructions;
pub(crate) mod math;
