"""Standard errors of joint angles from the Gauss-Newton matrices of the fit."""
