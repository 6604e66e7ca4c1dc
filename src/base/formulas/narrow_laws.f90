!> The list of a law carried out in groups of eight numbers: lanes of large machines, or elements of one lane.
module nocdyn_narrow_laws
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_node_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, op_harmonics, op_larger, &
    op_log_cosh, op_logarithm, op_multiply, op_power, op_reciprocal, op_scale, op_sech_squared, op_shift, op_sine, &
    op_square_root, op_subtract, op_tanh, op_wave
  use nocdyn_law_work, only: derivatives, fourth, harmonic_work, law_work_t, most_terms, second, third
  use nocdyn_laws, only: law_t, narrow
  use nocdyn_vector_functions, only: cosines, exps, log_cosh_of, sines, tanhs
  implicit none (type, external)
  private

  public :: walk

  integer, parameter :: w = narrow   !! numbers of a group

contains

  include 'law_series.inc'
  include 'law_harmonics.inc'
  include 'law_walk.inc'

end module nocdyn_narrow_laws
