"""From pixels to metres: scale, lens, calibration boards, the rim of the tank."""
