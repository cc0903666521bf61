//! Forward and inverse kinematics of serial arms from URDF.
