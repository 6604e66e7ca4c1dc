!> Designs of experiments: the values of the factors in each variant.
!>
!> The values of a variant are a function of its number, so that threads can compute them in any order. Only a list stores
!> values for each variant.
module nocdyn_designs
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_distributions, only: distribution_t, tail_end, lognormal_distribution, normal_distribution, uniform_distribution
  use nocdyn_kinds, only: wp
  use nocdyn_permutations, only: permutation_t, random_permutation
  use nocdyn_random_numbers, only: random_number_at, stream_offsets, stream_values
  use nocdyn_sobol_points, only: sobol_points, sobol_points_t
  implicit none (type, external)
  private

  public :: grid_design, sampled_design, list_design
  public :: grid_size, can_overflow, probability_between

  integer, parameter, public :: max_variants = 2000000000

  character(len=6), parameter :: words(5) = ['grid  ', 'random', 'latin ', 'sobol ', 'list  ']
  integer, parameter :: by_grid = 1, at_random = 2, latin = 3, sobol = 4, by_list = 5   ! indices of `words`

  real(wp), parameter :: last_offset = 1.0_wp - 2.0_wp**(-20)   ! in a stratum: rounding must not leave it

  !> A factor: a number that varies, and its distribution.
  type, public :: factor_t
    character(len=10) :: distribution = 'uniform'           !! 'uniform', 'normal', 'lognormal'
    real(wp) :: low = -huge(1.0_wp), high = huge(1.0_wp)   !! both are needed if uniform; other distributions are truncated there
    real(wp) :: mean = 0.0_wp, deviation = 1.0_wp          !! if normal; the deviation is positive
    real(wp) :: median = 1.0_wp, log_deviation = 1.0_wp    !! if lognormal; of the natural logarithm, positive
    integer :: count = 1                                   !! values of a grid, at least 1
  end type factor_t

  type, public :: design_t
    integer :: variants = 0   !! numbered from 1
    integer :: varied = 0     !! number of factors
    integer, private :: kind = by_list                               !! of `words`
    integer, private :: seed = 0
    type(factor_t), allocatable, private :: factors(:)               !! of a grid
    type(distribution_t), allocatable, private :: distributions(:)   !! of random values, [varied]
    type(permutation_t), allocatable, private :: strata(:)           !! if latin, [varied]
    type(sobol_points_t), private :: points                          !! if sobol
    real(wp), allocatable, private :: list(:, :)                     !! of a list, [varied, variants]
  contains
    procedure :: values
  end type design_t

contains

  !> All combinations of `count` equidistant values from `low` to `high` of each factor (`low` alone if `count` is 1). The last
  !> factor varies fastest. The distributions do not matter.
  type(design_t) function grid_design(factors) result(design)
    type(factor_t), intent(in) :: factors(:)   !! with `grid_size` at most `max_variants`

    if (grid_size(factors) > max_variants) error stop 'nocdyn_designs: the grid has too many variants'
    design%kind = by_grid
    design%variants = int(grid_size(factors))
    design%varied = size(factors)
    allocate (design%factors, source=factors)
  end function grid_design

  !> Number of points of a grid, at most `max_variants` + 1.
  pure integer(int64) function grid_size(factors)
    type(factor_t), intent(in) :: factors(:)
    integer :: i

    grid_size = 1
    do i = 1, size(factors)
      grid_size = min(grid_size * factors(i)%count, max_variants + 1_int64)
    end do
  end function grid_size

  !> The values of the factors in a variant.
  pure subroutine values(self, variant, x)
    class(design_t), intent(in) :: self
    integer, intent(in) :: variant   !! 1 to `variants`
    real(wp), intent(out) :: x(:)    !! [varied]
    integer :: i
    real(wp) :: probability

    select case (self%kind)
    case (by_grid)
      call grid_values(self%factors, variant, x)
    case (by_list)
      x = self%list(:, variant)
    case default
      do i = 1, self%varied
        ! the probability of values below the one of a factor in a variant
        select case (self%kind)
        case (at_random)
          probability = random_number_at(self%seed, stream_values, i, variant)
        case (latin)
          probability = (self%strata(i)%image(variant - 1) + &
                         min(random_number_at(self%seed, stream_offsets, i, variant), last_offset)) / self%variants
        case (sobol)
          probability = self%points%coordinate(variant - 1, i)
        case default
          error stop 'nocdyn_designs: there is no such design'
        end select
        x(i) = self%distributions(i)%quantile(probability)
      end do
    end select
  end subroutine values

  pure subroutine grid_values(factors, variant, x)
    type(factor_t), intent(in) :: factors(:)
    integer, intent(in) :: variant
    real(wp), intent(out) :: x(:)
    integer :: i, rest, step

    rest = variant - 1
    do i = size(factors), 1, -1
      associate (factor => factors(i))
        step = modulo(rest, factor%count)
        rest = rest / factor%count
        if (step == 0) then
          x(i) = factor%low
        else if (step == factor%count - 1) then
          x(i) = factor%high
        else
          x(i) = factor%low + (factor%high - factor%low) * (real(step, wp) / real(factor%count - 1, wp))
        end if
      end associate
    end do
  end subroutine grid_values

  !> Random values:
  !>
  !> - random: independent ones.
  !> - latin: a Latin hypercube (M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245): the range of each
  !>   factor is divided into as many equally probable strata as there are samples, with one random value in each stratum.
  !> - sobol: Sobol points from the first one on; a seed other than 0 shifts all of them.
  type(design_t) function sampled_design(word, factors, samples, seed) result(design)
    character(len=*), intent(in) :: word       !! 'random', 'latin', 'sobol'
    type(factor_t), intent(in) :: factors(:)   !! at most `max_dimensions` if sobol
    integer, intent(in) :: samples             !! at least 1
    integer, intent(in) :: seed                !! at least 0
    integer :: i

    design%variants = samples
    design%varied = size(factors)
    design%kind = findloc(words, word, dim=1)
    design%seed = seed
    allocate (design%distributions(size(factors)), design%strata(merge(size(factors), 0, word == 'latin')))
    do i = 1, size(factors)
      design%distributions(i) = distribution_of(factors(i))
      if (word == 'latin') design%strata(i) = random_permutation(samples, seed, i)
    end do
    if (word == 'sobol') design%points = sobol_points(size(factors), seed)
  end function sampled_design

  !> A list of values.
  type(design_t) function list_design(values) result(design)
    real(wp), intent(in) :: values(:, :)   !! [varied, variants]

    design%varied = size(values, 1)
    design%variants = size(values, 2)
    allocate (design%list, source=values)
  end function list_design

  !> The probability of the range from `low` to `high` without truncation. No value can be drawn if it is 0.
  pure real(wp) function probability_between(factor)
    type(factor_t), intent(in) :: factor
    type(distribution_t) :: distribution

    distribution = distribution_of(factor)
    probability_between = distribution%probability
  end function probability_between

  !> Whether a value of a lognormal factor can exceed the largest number.
  pure logical function can_overflow(factor)
    type(factor_t), intent(in) :: factor

    can_overflow = .false.
    if (factor%distribution == 'lognormal' .and. factor%high >= huge(factor%high)) then
      can_overflow = log(factor%median) + tail_end * factor%log_deviation > log(huge(factor%high))
    end if
  end function can_overflow

  pure type(distribution_t) function distribution_of(factor) result(distribution)
    type(factor_t), intent(in) :: factor

    select case (factor%distribution)
    case ('uniform')
      distribution = uniform_distribution(factor%low, factor%high)
    case ('normal')
      distribution = normal_distribution(factor%mean, factor%deviation, factor%low, factor%high)
    case ('lognormal')
      distribution = lognormal_distribution(factor%median, factor%log_deviation, factor%low, factor%high)
    case default
      error stop 'nocdyn_designs: there is no such distribution'
    end select
  end function distribution_of

end module nocdyn_designs
