!> Twists of the couplings at which they carry the torques of a steady state.
!>
!> They minimise the potential energy of the couplings minus the work of the other torques on the coordinates. Newton's method
!> uses the stiffness matrix; Levenberg's damping (Quart. Appl. Math. 2 (1944) 164) is added to its diagonal where a step would
!> not lower the energy, as inside of a gap or where a spring softens. The matrix is banded, in a good order of the coordinates.
module nocdyn_static_twists
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: band_factor, band_solve
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_text, only: to_text
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: find_twists, undetermined_elements

  integer, parameter :: largest_matrix = 6000   ! rows of a dense matrix with the largest allowed number of entries
  real(wp), parameter :: balanced = 1.0e-13_wp   ! torques below this share of their terms are rounding
  real(wp), parameter :: angle_rounding = 16 * epsilon(1.0_wp)   ! relative error of the angles of which a twist is the difference
  real(wp), parameter :: max_twist = 1.0e8_wp     ! rad: the iteration diverges
  real(wp), parameter :: most_damping = 1.0e12_wp

  !> The minimisation problem: the stiffness matrix of the coordinates that are not free, and the torques. Where every stiffness
  !> is as before, the factors serve again: a linear machine is factored once for all its steady states.
  type, public :: twist_problem_t
    private
    integer, allocatable :: unknown(:)    !! coordinates in the order of the band, [unknowns]
    integer, allocatable :: position(:)   !! position of each coordinate in the band, 0 if it is free, [coordinates]
    integer :: width = 0                  !! number of diagonals beside the main one
    real(wp), allocatable :: band(:, :)   !! factors
    integer, allocatable :: pivots(:)
    real(wp), allocatable :: factored(:)  !! stiffnesses of the factors [N m/rad], [elastic elements]; not allocated: none
    real(wp), allocatable :: diagonal_scale(:)   !! what is damped: the largest diagonal elements so far, [unknowns]
    real(wp), allocatable :: diagonal(:), row_sum(:)   !! of the matrix without damping, and sums of magnitudes, [unknowns]
    real(wp), allocatable :: external_torque(:)   !! torques of all other elements [N m], [coordinates]
    real(wp), allocatable :: external_scale(:)   !! sum of their absolute terms, [coordinates]
    real(wp) :: floor = 0.0_wp   !! smallest torque that is not rounding [N m]
    real(wp), allocatable :: torque(:)   !! residual [N m], [coordinates]
    real(wp), allocatable :: tolerance(:)   !! rounding of the residual, from its terms and from the angles [N m], [coordinates]
    real(wp) :: energy = 0.0_wp
  end type twist_problem_t

contains

  !> Finds the angles q of the coordinates; free coordinates stay. `balance` is evaluated at the speeds of the steady state.
  subroutine find_twists(self, balance, q, is_found, error, weight, torque)
    type(twist_problem_t), intent(inout) :: self      !! of the same balance before, or new
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: q(:)   !! start, then solution [rad], [coordinates]
    logical, intent(out) :: is_found
    type(error_t), allocatable, intent(out) :: error   !! if the stiffness matrix is too large
    real(wp), intent(in), optional :: weight(:)        !! factors on the moments of the inelastic elements, [elements]; absent: 1
    real(wp), intent(in), optional :: torque(:)        !! more torques on the coordinates [N m], [coordinates]; absent: none
    real(wp), parameter :: rounding = 1.0e-12_wp
    integer, parameter :: most_steps = 500, most_idle = 40   ! of all, and of those without a residual that is `lower`
    real(wp), parameter :: lower = 0.99_wp
    real(wp), parameter :: stalled = 1.0e3_wp   ! residuals up to this many tolerances are rounding if they stop falling
    real(wp) :: damping, energy, excess, last_excess, least_excess, new_q(size(q)), step(size(q))
    integer :: i, idle
    logical :: is_singular

    is_found = .false.
    if (.not. allocated(self%unknown)) call set_up(balance, self, error)
    if (allocated(error)) return
    call find_external(balance, self, weight, torque)
    call evaluate_angles(balance, q, self)
    self%diagonal_scale = 0.0_wp
    damping = 0.0_wp
    last_excess = huge(1.0_wp)
    least_excess = huge(1.0_wp)
    idle = 0
    do i = 1, most_steps
      ! the largest residual, in units of its tolerance
      associate (torque => abs(self%torque(self%unknown)))
        excess = max(0.0_wp, maxval(torque / self%tolerance(self%unknown), mask=torque > 0.0_wp))
      end associate
      is_found = excess <= 1.0_wp .or. (excess <= stalled .and. excess > 0.5_wp * last_excess)
      if (is_found) exit
      last_excess = excess
      idle = idle + 1
      if (excess < lower * least_excess) then
        idle = 0
        least_excess = excess
      end if
      energy = self%energy
      call solve(balance, damping, self, step, is_singular)
      new_q = q + step
      if (.not. is_singular) call evaluate_angles(balance, new_q, self)
      if (.not. is_singular .and. (self%energy <= energy + rounding * (abs(energy) + sum(abs(self%external_torque * step))))) then
        q = new_q
        damping = merge(0.0_wp, 0.1_wp * damping, damping < 1.0e-8_wp)
        is_found = all(abs(step) <= 4 * spacing(abs(q)))
      else
        call evaluate_angles(balance, q, self)
        call raise_damping(self, damping)
      end if
      if (is_found .or. idle > most_idle .or. damping > most_damping .or. maxval(abs(q)) > max_twist) exit
    end do
  end subroutine find_twists

  !> Raises the damping after a step that was too large, at least to where the step can be smaller than the largest twist: with
  !> (K + damping D) step = torque no torque is larger than (sum of |K| + damping D) times the largest component of the step.
  pure subroutine raise_damping(self, damping)
    type(twist_problem_t), intent(in) :: self   !! after `evaluate_angles` and `solve`
    real(wp), intent(inout) :: damping
    real(wp), parameter :: reserve = 0.5_wp     ! for rounding
    real(wp) :: least

    least = 0.0_wp
    if (size(self%unknown) > 0) then
      associate (scale => max(self%diagonal_scale, self%diagonal))
        least = maxval((reserve * abs(self%torque(self%unknown)) / max_twist - self%row_sum) / merge(scale, 1.0_wp, scale > 0))
      end associate
    end if
    damping = max(10.0_wp * damping, 1.0e-6_wp)
    do while (damping < least .and. damping <= most_damping)
      damping = 10.0_wp * damping
    end do
  end subroutine raise_damping

  !> Elastic elements whose twists are not determined: at the solution, rigid motions of the elements with stiffness twist them.
  function undetermined_elements(balance) result(undetermined)
    type(torque_balance_t), intent(in) :: balance   !! after `find_twists`
    integer, allocatable :: undetermined(:)
    type(rigid_motions_t) :: motions
    integer, allocatable :: slack(:)   ! elastic elements without stiffness
    integer :: i

    associate (stiffness => balance%formulation%state%elements%restoring_angle(1, balance%elastic))
      slack = pack(balance%elastic, abs(stiffness) <= 0.0_wp)
      if (size(slack) > 0) motions = new_rigid_motions(balance%coordinates, balance%incidence, &
                                                       pack(balance%elastic, abs(stiffness) > 0.0_wp))
    end associate
    undetermined = pack(slack, [(is_twisted(balance, motions, slack(i)), i=1, size(slack))])
  end function undetermined_elements

  !> Whether a rigid motion twists an element.
  pure logical function is_twisted(balance, motions, element)
    type(torque_balance_t), intent(in) :: balance
    type(rigid_motions_t), intent(in) :: motions
    integer, intent(in) :: element
    real(wp), parameter :: rounding = 1.0e-10_wp   ! as a share of the terms
    real(wp) :: rate(size(motions%free)), scale(size(motions%free))
    integer :: i, k

    rate = 0.0_wp
    scale = 0.0_wp
    do k = balance%incidence%first(element), balance%incidence%first(element + 1) - 1
      associate (c => balance%incidence%coordinate(k), ratio => balance%incidence%ratio(1, k))
        do i = motions%first(c), motions%first(c + 1) - 1
          associate (freedom => motions%freedom(i))
            rate(freedom) = rate(freedom) + ratio * motions%ratio(i)
            scale(freedom) = scale(freedom) + abs(ratio * motions%ratio(i))
          end associate
        end do
      end associate
    end do
    is_twisted = any(abs(rate) > rounding * scale)
  end function is_twisted

  !> Sets the order of the coordinates.
  subroutine set_up(balance, self, error)
    type(torque_balance_t), intent(in) :: balance
    type(twist_problem_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if the band is too large
    type(entries_t) :: entries
    integer :: number(balance%coordinates), order(balance%coordinates - size(balance%loose%free))
    integer :: c, e, i, k, n, upper

    number = 1
    number(balance%loose%free) = 0
    self%unknown = pack([(c, c=1, size(number))], number == 1)
    number(self%unknown) = [(c, c=1, size(self%unknown))]
    ! pairs of coordinates that an elastic element couples
    associate (first => balance%incidence%first, coordinate => balance%incidence%coordinate)
      n = sum((first(balance%elastic + 1) - first(balance%elastic))**2)
      allocate (entries%row(n), entries%column(n))
      n = 0
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        do k = first(e), first(e + 1) - 1
          associate (members => number(coordinate(first(e):first(e + 1) - 1)))
            if (number(coordinate(k)) == 0) cycle
            entries%row(n + 1:n + count(members > 0)) = pack(members, members > 0)
            entries%column(n + 1:n + count(members > 0)) = number(coordinate(k))
            n = n + count(members > 0)
          end associate
        end do
      end do
    end associate
    entries%row = entries%row(:n)
    entries%column = entries%column(:n)
    order = reverse_cuthill_mckee(size(order), entries%row, entries%column)
    call half_bandwidths(order, entries, self%width, upper)
    if ((3.0_wp * self%width + 1.0_wp) * size(order) > real(largest_matrix, wp)**2) then
      call raise(error, exit_input, 'the twists need a matrix of ' // to_text(3 * self%width + 1) // ' x ' // &
                 to_text(size(order)) // ' entries for this machine, whose couplings leave no narrower band; at most ' // &
                 to_text(largest_matrix) // ' x ' // to_text(largest_matrix) // ' are allowed')
      deallocate (self%unknown)
      return
    end if
    self%unknown = self%unknown(order)
    allocate (self%position(size(number)), source=0)
    self%position(self%unknown) = [(c, c=1, size(self%unknown))]
    allocate (self%band(3 * self%width + 1, size(self%unknown)), self%diagonal_scale(size(self%unknown)), &
              self%diagonal(size(self%unknown)), self%row_sum(size(self%unknown)), source=0.0_wp)
    allocate (self%external_torque(size(number)), self%torque(size(number)), source=0.0_wp)
    allocate (self%external_scale, self%tolerance, source=self%external_torque)
    allocate (self%pivots(size(self%unknown)))
  end subroutine set_up

  !> Computes the torques of the inelastic elements, and the part of the elastic ones that does not depend on the twist.
  subroutine find_external(balance, self, weight, torque)
    type(torque_balance_t), intent(in) :: balance
    type(twist_problem_t), intent(inout) :: self
    real(wp), intent(in), optional :: weight(:), torque(:)   !! as in `find_twists`
    real(wp) :: moment
    integer :: e, k

    self%external_torque = 0.0_wp
    self%external_scale = 0.0_wp
    associate (elements => balance%formulation%state%elements, incidence => balance%incidence)
      do e = 1, size(balance%is_elastic)
        moment = elements%applied(1, e)
        if (.not. balance%is_elastic(e)) moment = moment + elements%restoring(1, e)
        if (present(weight)) moment = weight(e) * moment
        do k = incidence%first(e), incidence%first(e + 1) - 1
          associate (c => incidence%coordinate(k))
            self%external_torque(c) = self%external_torque(c) + incidence%ratio(1, k) * moment
            self%external_scale(c) = self%external_scale(c) + abs(incidence%ratio(1, k) * moment)
          end associate
        end do
      end do
    end associate
    if (present(torque)) then
      self%external_torque = self%external_torque + torque
      self%external_scale = self%external_scale + abs(torque)
    end if
    if (size(self%external_torque) > 0) self%floor = max(0.01_wp * epsilon(1.0_wp) * maxval(self%external_scale), tiny(1.0_wp))
  end subroutine find_external

  !> Evaluates the elements at the angles q: residual torques and energy.
  subroutine evaluate_angles(balance, q, self)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: q(:)   !! [rad], [coordinates]
    type(twist_problem_t), intent(inout) :: self
    integer :: c, e, i, k
    real(wp) :: rounding

    balance%y(1, size(q) + 1:2 * size(q)) = q
    call balance%formulation%start_lane(1, balance%t(1), reshape(balance%y, [size(balance%y)]))
    call balance%formulation%derivative(balance%t, balance%y, balance%rate, balance%status)
    associate (machine => balance%formulation%machine, state => balance%formulation%state)
      call state%differentiate_elements(machine, balance%t)
      call state%evaluate_energies(machine)
    end associate
    self%torque = self%external_torque
    self%tolerance = self%floor + balanced * self%external_scale
    associate (elements => balance%formulation%state%elements, incidence => balance%incidence, phi => balance%formulation%phi, &
               rows => balance%formulation%machine%elements%rows)
      self%energy = sum(elements%stored(1, balance%elastic)) - sum(self%external_torque * q)
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        rounding = balanced * abs(elements%restoring(1, e)) + angle_rounding * abs(elements%restoring_angle(1, e)) &
                   * sum([(abs(rows%coefficient(k) * phi(1, rows%body(k))), k=rows%first(e), rows%first(e + 1) - 1)])
        do k = incidence%first(e), incidence%first(e + 1) - 1
          c = incidence%coordinate(k)
          self%torque(c) = self%torque(c) + incidence%ratio(1, k) * elements%restoring(1, e)
          self%tolerance(c) = self%tolerance(c) + abs(incidence%ratio(1, k)) * rounding
        end do
      end do
    end associate
  end subroutine evaluate_angles

  !> Solves (K + damping * diagonal_scale) step = torque, after `evaluate_angles`.
  subroutine solve(balance, damping, self, step, is_singular)
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: damping   !! Levenberg parameter, 0: a Newton step
    type(twist_problem_t), intent(inout) :: self
    real(wp), intent(out) :: step(:)   !! [rad], [coordinates]
    logical, intent(out) :: is_singular
    real(wp) :: x(size(self%unknown))

    step = 0.0_wp
    is_singular = .false.
    if (size(self%unknown) == 0) return
    associate (slopes => balance%formulation%state%elements%restoring_angle(1, balance%elastic))
      if (allocated(self%factored)) then
        if (damping > 0 .or. any(abs(self%factored - slopes) > 0)) deallocate (self%factored)
      end if
      if (.not. allocated(self%factored)) then
        call fill(balance, damping, self)
        call band_factor(self%width, self%width, self%band, self%pivots, is_singular)
        if (is_singular) return
        if (.not. damping > 0) self%factored = slopes
      end if
    end associate
    x = self%torque(self%unknown)
    call band_solve(self%width, self%width, self%band, self%pivots, x)
    step(self%unknown) = x
    if (maxval(abs(x)) > max_twist) is_singular = .true.
  end subroutine solve

  !> Fills the matrix K + damping * diagonal_scale.
  subroutine fill(balance, damping, self)
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: damping
    type(twist_problem_t), intent(inout) :: self
    integer :: column, diagonal, e, i, k, l, row

    self%band = 0.0_wp
    diagonal = 2 * self%width + 1
    associate (elements => balance%formulation%state%elements, incidence => balance%incidence)
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        do k = incidence%first(e), incidence%first(e + 1) - 1
          do l = incidence%first(e), incidence%first(e + 1) - 1
            row = self%position(incidence%coordinate(k))
            column = self%position(incidence%coordinate(l))
            if (min(row, column) == 0) cycle
            associate (entry => self%band(diagonal + row - column, column))
              entry = entry - incidence%ratio(1, k) * incidence%ratio(1, l) * elements%restoring_angle(1, e)
            end associate
          end do
        end do
      end do
    end associate
    self%diagonal = self%band(diagonal, :)
    self%row_sum = sum(abs(self%band), dim=1)   ! it is symmetric
    self%diagonal_scale = max(self%diagonal_scale, self%diagonal)
    self%band(diagonal, :) = self%band(diagonal, :) + damping * merge(self%diagonal_scale, 1.0_wp, self%diagonal_scale > 0.0_wp)
  end subroutine fill

end module nocdyn_static_twists
