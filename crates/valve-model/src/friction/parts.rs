//! The parameters that the laws have in common, whichever law it is.

use super::FrictionParams;

impl FrictionParams {
    pub(crate) fn coulomb_mut(&mut self) -> &mut f64 {
        match self {
            Self::Stribeck(params) => &mut params.coulomb_torque_nm,
            Self::Dahl(params) => &mut params.coulomb_torque_nm,
            Self::LuGre(params) => &mut params.coulomb_torque_nm,
            Self::Leuven(params) => &mut params.coulomb_torque_nm,
        }
    }

    pub(crate) fn static_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Stribeck(params) => Some(&mut params.static_torque_nm),
            Self::Dahl(_) => None,
            Self::LuGre(params) => Some(&mut params.static_torque_nm),
            Self::Leuven(params) => Some(&mut params.static_torque_nm),
        }
    }

    pub(crate) fn viscous_mut(&mut self) -> &mut f64 {
        match self {
            Self::Stribeck(params) => &mut params.viscous_nm_s_per_rad,
            Self::Dahl(params) => &mut params.viscous_nm_s_per_rad,
            Self::LuGre(params) => &mut params.viscous_nm_s_per_rad,
            Self::Leuven(params) => &mut params.viscous_nm_s_per_rad,
        }
    }

    pub(crate) fn stribeck_velocity_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Stribeck(params) => Some(&mut params.stribeck_velocity_rad_per_s),
            Self::Dahl(_) => None,
            Self::LuGre(params) => Some(&mut params.stribeck_velocity_rad_per_s),
            Self::Leuven(params) => Some(&mut params.stribeck_velocity_rad_per_s),
        }
    }

    pub(crate) fn damping_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Stribeck(_) | Self::Dahl(_) => None,
            Self::LuGre(params) => Some(&mut params.bristle_damping_nm_s_per_rad),
            Self::Leuven(params) => Some(&mut params.bristle_damping_nm_s_per_rad),
        }
    }

    pub(crate) fn stiffness_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Stribeck(_) => None,
            Self::Dahl(params) => Some(&mut params.bristle_stiffness_nm_per_rad),
            Self::LuGre(params) => Some(&mut params.bristle_stiffness_nm_per_rad),
            Self::Leuven(params) => Some(&mut params.bristle_stiffness_nm_per_rad),
        }
    }
}
