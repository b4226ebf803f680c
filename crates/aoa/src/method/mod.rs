//! Estimation methods: from a covariance or its eigenvectors to electrical angles.

pub(crate) mod alternating_projection;
pub(crate) mod esprit;
pub(crate) mod maximum_likelihood;
pub(crate) mod music;
pub(crate) mod root_music;
