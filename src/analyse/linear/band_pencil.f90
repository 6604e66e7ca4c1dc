!> The undamped oscillations of a machine as a pencil K - s M of real symmetric band matrices, s the square of a frequency.
!>
!> K and M are the parts of the dynamic stiffness. How many squares of natural frequencies are below a shift is the number of
!> negative eigenvalues of the matrix (Sturm's count). An element that is much stiffer than the inertia beside it has its moment
!> as an unknown, and so has an element that does not turn, without compliance; each of these moments makes one more eigenvalue
!> negative.
module nocdyn_band_pencil
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, list_mass, new_band_work, new_dynamic_stiffness, &
    rigid_stiffness
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_lapack_lu, only: band_factor, band_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_symmetric_band, only: negative_pivots, semidefinite_rank
  implicit none (type, external)
  private

  public :: new_band_pencil

  type, public :: band_pencil_t
    integer :: coordinates = 0
    integer :: rigid = 0                             !! number of the motions without any twist
    integer :: modes = 0                             !! coordinates less what joints hold
    real(wp) :: lowest = 0.0_wp                      !! about the least s > 0 of a mode that is not rigid [rad2/s2];
                                                     !! 0, and so are the ends: nothing is elastic
    integer :: negative = 0                          !! number of the motions that a negative stiffness drives apart
    real(wp) :: bottom = 0.0_wp, top = 0.0_wp        !! no s is below or above [rad2/s2]
    type(element_coordinates_t) :: incidence         !! U
    type(dynamic_stiffness_t) :: matrix
    integer, allocatable :: locked(:)                !! elements that do not turn, as far as others do not hold them already
    real(wp), allocatable :: stiffness(:)            !! k, without the elements that do not turn [N m/rad], [elements]
    complex(wp), allocatable, private :: complete(:) !! with them
    integer, allocatable, private :: row(:), column(:)   !! of the entries of M
    real(wp), allocatable, private :: mass(:)            !! [kg m2], [entries]
    integer, private :: moments = 0                      !! unknowns that make eigenvalues negative
    type(band_work_t), private :: work
    real(wp), allocatable, private :: band(:, :), x(:)
    integer, allocatable, private :: pivots(:)
  contains
    procedure :: count_below, factor, solve, masses_times, twists_of, place_between, step_aside
  end type band_pencil_t

contains

  !> The pencil of a machine in one state.
  subroutine new_band_pencil(machine, incidence, stiffness, held, self, error)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    real(wp), intent(in) :: stiffness(:)                   !! k of all elements [N m/rad], [elements]
    integer, intent(in) :: held(:)                         !! elements that do not turn
    type(band_pencil_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error       !! the band is too wide
    integer :: round
    real(wp), parameter :: no_moments = 1.0e40_wp          ! [rad/s]
    real(wp) :: frequency, known

    self%incidence = incidence
    self%coordinates = machine%coordinates%freedoms
    self%stiffness = stiffness
    self%stiffness(held) = 0.0_wp
    self%complete = cmplx(stiffness, kind=wp)
    self%complete(held) = 0.0_wp
    call find_independent(incidence, held, self%locked)
    self%complete(self%locked) = rigid_stiffness
    self%modes = self%coordinates - size(self%locked)
    call list_mass(machine, self%row, self%column, self%mass)
    frequency = no_moments
    do round = 1, 3   ! the moments that are unknowns depend on the lowest frequency, found first without any
      call new_dynamic_stiffness(machine, incidence, frequency, abs(self%complete), self%matrix, error, moments_follow=.true.)
      if (allocated(error)) return
      call set_work(self)
      if (round == 1) then
        call find_rigid(self, machine, held, error)
        if (allocated(error) .or. self%rigid == self%modes) return
      end if
      known = self%lowest
      call find_ends(self)
      frequency = sqrt(self%lowest)
      if (round > 1 .and. known < 10 * self%lowest .and. known > self%lowest / 10) return
    end do
  end subroutine new_band_pencil

  !> Work space for the present matrix.
  subroutine set_work(self)
    type(band_pencil_t), intent(inout) :: self
    integer :: rows, unknowns

    self%work = new_band_work(self%matrix)
    self%moments = self%matrix%positive_moments(self%complete)
    rows = size(self%work%band, 1)
    unknowns = size(self%work%band, 2)
    if (allocated(self%band)) deallocate (self%band, self%x, self%pivots)
    allocate (self%band(rows, unknowns), self%x(unknowns), source=0.0_wp)
    allocate (self%pivots(unknowns), source=0)
  end subroutine set_work

  !> Elements that do not turn, less the ones that others hold already.
  subroutine find_independent(incidence, held, independent)
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: held(:)
    integer, allocatable, intent(out) :: independent(:)
    real(wp), parameter :: rounding = 1.0e-10_wp   ! relative
    integer :: e, i, k, pivots(size(held)), rank
    integer, allocatable :: columns(:)
    real(wp), allocatable :: rates(:, :)

    allocate (columns(0))
    do e = 1, size(held)
      do i = incidence%first(held(e)), incidence%first(held(e) + 1) - 1
        if (.not. any(columns == incidence%coordinate(i))) columns = [columns, incidence%coordinate(i)]
      end do
    end do
    allocate (rates(size(columns), size(held)), source=0.0_wp)
    do e = 1, size(held)
      do i = incidence%first(held(e)), incidence%first(held(e) + 1) - 1
        k = findloc(columns, incidence%coordinate(i), dim=1)
        rates(k, e) = incidence%ratio(1, i)
      end do
      rates(:, e) = rates(:, e) / max(norm2(rates(:, e)), tiny(1.0_wp))
    end do
    call pivoted_rank(rates, rounding, rank, pivots)
    independent = held(pivots(:rank))
  end subroutine find_independent

  !> The number of the motions without any twist: the rank of the twists' sum of squares, each scaled to 1.
  subroutine find_rigid(self, machine, held, error)
    type(band_pencil_t), intent(inout) :: self     !! with its matrix without moments as unknowns
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: held(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: no_moments = 1.0e40_wp          ! [rad/s]
    complex(wp) :: unit(size(self%stiffness))
    type(band_work_t) :: work
    type(dynamic_stiffness_t) :: plain
    real(wp), allocatable :: band(:, :)
    integer :: e, rank

    call new_dynamic_stiffness(machine, self%incidence, no_moments, spread(0.0_wp, 1, size(unit)), plain, error)
    if (allocated(error)) return
    unit = merge((1.0_wp, 0.0_wp), (0.0_wp, 0.0_wp), abs(self%stiffness) > 0)
    unit(held) = 1.0_wp
    do e = 1, size(unit)
      associate (ratios => self%incidence%ratio(1, self%incidence%first(e):self%incidence%first(e + 1) - 1))
        if (abs(unit(e)) > 0) unit(e) = 1.0_wp / max(sum(ratios**2), tiny(1.0_wp))
      end associate
    end do
    work = new_band_work(plain)
    allocate (band, source=real(work%band, wp))
    call plain%fill_real(0.0_wp, unit, work, band)
    call semidefinite_rank(plain%width, 2 * plain%width + 1, band, rank)
    self%rigid = self%coordinates - rank
  end subroutine find_rigid

  !> Sets the ends of the spectrum, and about the least s of a mode that is not rigid.
  subroutine find_ends(self)
    class(band_pencil_t), intent(inout) :: self
    real(wp), parameter :: step = 16.0_wp, none = 1.0e-30_wp, negligible = 1.0e-13_wp, least_end = 1.0e250_wp
    integer :: below, found
    real(wp) :: high, low, middle

    self%top = 1.0_wp
    call self%count_below(self%top, found)
    do while (found < self%modes .and. self%top < least_end)
      self%top = step * self%top
      call self%count_below(self%top, found)
    end do
    do while (found == self%modes .and. self%top > 1.0_wp / least_end)
      self%top = self%top / step
      call self%count_below(self%top, found)
    end do
    self%top = self%top * step
    self%negative = 0
    if (any(self%stiffness < 0)) call self%count_below(-negligible * self%top, self%negative)
    below = self%rigid + self%negative
    low = none * self%top
    high = self%top
    do while (high > 2 * low)
      middle = sqrt(low) * sqrt(high)
      call self%count_below(middle, found)
      if (found > below) then
        high = middle
      else
        low = middle
      end if
    end do
    self%lowest = high
    self%bottom = -high / 2
    if (self%negative == 0) return
    self%bottom = -self%top * negligible
    found = self%negative
    do while (found > 0 .and. self%bottom > -least_end)
      self%bottom = step * self%bottom
      call self%count_below(self%bottom, found)
    end do
  end subroutine find_ends

  !> The number of modes with s below a shift.
  subroutine count_below(self, shift, below)
    class(band_pencil_t), intent(inout) :: self
    real(wp), intent(in) :: shift    !! [rad2/s2]
    integer, intent(out) :: below

    call self%matrix%fill_real(shift, self%complete, self%work, self%band)
    call negative_pivots(self%matrix%width, 2 * self%matrix%width + 1, self%band, below)
    below = below - self%moments
  end subroutine count_below

  !> Finds a shift that so many modes are below, between two others; if there is none, as of modes that are equal, the next one
  !> above. No mode is right beside it.
  subroutine place_between(self, low, high, least, most, shift, below)
    class(band_pencil_t), intent(inout) :: self
    real(wp), intent(in) :: low, high      !! with at most `least` and at least `most` modes below [rad2/s2]
    integer, intent(in) :: least, most     !! modes
    real(wp), intent(out) :: shift         !! [rad2/s2]
    integer, intent(out) :: below          !! modes below it
    real(wp), parameter :: same = 1.0e-9_wp
    real(wp) :: a, b

    a = low
    b = high
    shift = high
    call self%count_below(shift, below)
    do while (below > most .and. b - a > same * max(abs(a), abs(b)))
      shift = 0.5_wp * (a + b)
      if (a > 0 .and. b > 4 * a) shift = sqrt(a) * sqrt(b)
      call self%count_below(shift, below)
      if (below < least) a = shift
      if (below > most) b = shift
      if (below < least) below = most + 1
    end do
    if (below > most) shift = b
    call self%step_aside(shift, below)
  end subroutine place_between

  !> Moves a shift up, if a mode is right beside it, and counts the modes below.
  subroutine step_aside(self, shift, below)
    class(band_pencil_t), intent(inout) :: self
    real(wp), intent(inout) :: shift       !! [rad2/s2]
    integer, intent(out) :: below
    real(wp), parameter :: beside = 1.0e-10_wp, step = 4.0_wp
    integer, parameter :: most_steps = 20
    integer :: above, k

    do k = 1, most_steps
      call self%count_below(shift * (1.0_wp - beside), below)
      call self%count_below(shift * (1.0_wp + beside), above)
      if (above == below) return
      shift = shift + step**k * beside * abs(shift)
    end do
  end subroutine step_aside

  !> Factors K - s M.
  subroutine factor(self, shift)
    class(band_pencil_t), intent(inout) :: self
    real(wp), intent(in) :: shift   !! [rad2/s2]
    real(wp), parameter :: beside = 1.0e-13_wp
    logical :: singular

    call self%matrix%fill_real(shift, self%complete, self%work, self%band)
    call band_factor(self%matrix%width, self%matrix%width, self%band, self%pivots, singular)
    if (.not. singular) return
    call self%matrix%fill_real(shift * (1.0_wp + beside), self%complete, self%work, self%band)
    call band_factor(self%matrix%width, self%matrix%width, self%band, self%pivots, singular)
  end subroutine factor

  !> Solves (K - s M) x = b after `factor`.
  subroutine solve(self, x)
    class(band_pencil_t), intent(inout) :: self
    real(wp), intent(inout) :: x(:)   !! b, on return x; [coordinates]

    self%x = 0.0_wp   ! also of the moments
    self%x(self%matrix%position(:self%coordinates)) = x
    call band_solve(self%matrix%width, self%matrix%width, self%band, self%pivots, self%x)
    x = self%x(self%matrix%position(:self%coordinates))
  end subroutine solve

  !> M x.
  pure function masses_times(self, x) result(product)
    class(band_pencil_t), intent(in) :: self
    real(wp), intent(in) :: x(:)        !! [coordinates]
    real(wp) :: product(size(x))        !! [coordinates]
    integer :: k

    product = 0.0_wp
    do k = 1, size(self%row)
      product(self%row(k)) = product(self%row(k)) + self%mass(k) * x(self%column(k))
    end do
  end function masses_times

  !> The twists U x of all elements.
  pure function twists_of(self, x) result(twists)
    class(band_pencil_t), intent(in) :: self
    real(wp), intent(in) :: x(:)                     !! [coordinates]
    real(wp) :: twists(size(self%stiffness))         !! [elements]
    integer :: e, i

    do e = 1, size(twists)
      twists(e) = 0.0_wp
      do i = self%incidence%first(e), self%incidence%first(e + 1) - 1
        twists(e) = twists(e) + self%incidence%ratio(1, i) * x(self%incidence%coordinate(i))
      end do
    end do
  end function twists_of

end module nocdyn_band_pencil
