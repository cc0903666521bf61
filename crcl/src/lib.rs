//! The canonical robot command language: text, JSON, diagnostics.
