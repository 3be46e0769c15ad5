//! Measures of the hall, in meters: a nave along z between two arcades of two storeys, with aisles behind them.

/// From column to column.
pub const BAY: f64 = 3.4;
/// Bays of an arcade.
pub const BAYS: usize = 8;
/// Half of the length of the hall.
pub const HALF_LENGTH: f64 = BAY * BAYS as f64 / 2.0;
/// From the middle of the nave to the columns.
pub const ARCADE: f64 = 4.0;
/// Thickness of the arcades above the columns.
pub const THICKNESS: f64 = 0.7;
/// From the middle of the nave to the outer walls.
pub const WALL: f64 = 7.4;
/// Top of all walls.
pub const TOP: f64 = 11.0;
/// Radius of the arches of the arcades.
pub const ARCH: f64 = 1.27;
/// Radius of the vaults over the aisles.
pub const VAULT: f64 = (WALL - ARCADE - THICKNESS / 2.0) / 2.0;
/// Half of the width of the apse, and where its arch begins.
pub const APSE: f64 = 1.9;
pub const APSE_SPRINGING: f64 = 4.4;

/// A storey of the arcades.
#[derive(Clone, Copy, Debug)]
pub struct Storey {
    /// Where the columns stand.
    pub floor: f64,
    /// Where the arches begin.
    pub springing: f64,
    /// Where the wall over the arches ends.
    pub top: f64,
    /// Radius of the columns.
    pub column: f64,
}

/// Both storeys.
pub const STOREYS: [Storey; 2] = [
    Storey { floor: 0.0, springing: 3.6, top: 5.35, column: 0.33 },
    Storey { floor: 5.75, springing: 8.65, top: 10.45, column: 0.26 },
];
