//! Scattering models.
