!> The reduced formulation: L_tau^T J L_tau q'' = L_tau^T (Q + C omega + K phi). Its states are q', q and the internal states z of
!> the elements; the work integrals follow.
!>
!> The motion of the bodies is not computed on the way. The elements have the angles u = u_0 + U q and the speeds
!> u' = U q'. Their moments M give q'' = R M with R = (L_tau^T J L_tau)^-1 L_tau^T B, where the columns of B are
!> the unit moments of the elements on their two bodies, and U = B^T L_tau.
module nocdyn_reduced
  use nocdyn_code_text, only: code_text_t
  use nocdyn_compiled_code, only: loaded_code_t
  use nocdyn_compiled_series, only: compiled_series_t
  use nocdyn_coordinate_formulation, only: coordinate_formulation_t
  use nocdyn_held_lanes, only: held_lanes_t, new_held_lanes
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_law_tape, only: op_tanh
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_code, only: write_machine_code
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_reduced_jacobian, only: new_reduced_jacobian, reduced_jacobian_t
  use nocdyn_reduced_series, only: new_reduced_series, reduced_series_t
  use nocdyn_series_code, only: code_obstacle, write_series_code
  use nocdyn_sparse_map, only: new_sparse_map, sparse_map_t, transposed_order
  use nocdyn_system, only: evaluation_fatal, pattern_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_reduced
  public :: derivative   ! for extensions that add to it

  type, extends(coordinate_formulation_t), public :: reduced_t
    type(held_lanes_t) :: held                              !! joints that hold, with series or of a block
    logical :: is_block = .false.                           !! whether it is laid out as a block, whose parameters can be listed
    type(sparse_map_t), private :: accelerations            !! R
    integer, allocatable, private :: response_entry(:)      !! entry of `incidence` of each entry of R
    type(reduced_jacobian_t), private :: element_jacobian   !! R diag U
    type(reduced_series_t), private :: series_kernel        !! Taylor recurrence, after `prepare_series`
    type(compiled_series_t), private :: compiled            !! a program for the recurrence, if there is one
    real(wp), allocatable, private :: moment(:, :)             !! M [N m], [lanes, elements], work space
    real(wp), allocatable, private :: free_jacobian(:, :)      !! without locked joints, if there are joints, [lanes, positions]
  contains
    procedure :: formulate, update_inertia, pass_parameters, refresh_lane, refresh_parameters, refresh_laws, derivative, jacobian
    procedure :: evaluate_at, hold_jacobian, spread_jacobian
    procedure :: jacobian_pattern, series_obstacle, prepare_series, series, find_sets
    procedure :: write_code, write_program, attach_code, runs_code, takes_plain_steps, take_plain_steps
    procedure :: change_plain_branches
  end type reduced_t

contains

  !> The formulation of a machine whose coordinates are known.
  function new_reduced(machine, with_energy_balance, as_block) result(self)
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated
    logical, intent(in), optional :: as_block    !! whether a single lane gets the layout of a block; absent: no
    type(reduced_t) :: self

    self%machine = machine
    if (present(as_block)) self%is_block = as_block
    call self%formulate(with_energy_balance)
  end function new_reduced

  !> Forms the equations of `machine`, after any change of its structure; laid out as a block if `is_block`, or of many lanes.
  subroutine formulate(self, with_energy_balance)
    class(reduced_t), intent(inout) :: self
    logical, intent(in) :: with_energy_balance   !! as in `new_reduced`

    self%is_block = self%is_block .or. self%machine%lanes > 1
    call self%set_coordinates(with_energy_balance, self%is_block)
    associate (machine => self%machine, incidence => self%incidence, freedoms => self%machine%coordinates%freedoms)
      call form_responses(freedoms, self%is_block, self)
      self%element_jacobian = new_reduced_jacobian(freedoms, incidence, machine%with_work(:self%quadratures), machine%elements)
      self%moment = 0.0_wp * self%zero_twist
      if (allocated(self%free_jacobian)) deallocate (self%free_jacobian)
      if (self%joints%count > 0) allocate (self%free_jacobian(machine%lanes, size(self%element_jacobian%pattern%row)))
      if (machine%lanes > 1) call self%prepare_series(1)
    end associate
  end subroutine formulate

  !> The map R from moments to accelerations; its rows are the coordinates.
  subroutine form_responses(freedoms, without_bands, self)
    integer, intent(in) :: freedoms
    logical, intent(in) :: without_bands   !! whether the map is stored by rows only
    type(reduced_t), intent(inout) :: self
    integer :: element_of(size(self%incidence%coordinate)), first(freedoms + 1)

    element_of = self%incidence%entry_elements()
    associate (incidence => self%incidence)
      if (allocated(self%response_entry)) deallocate (self%response_entry)
      allocate (self%response_entry(size(incidence%coordinate)))
      call transposed_order(incidence%coordinate, freedoms, self%response_entry, first)
      self%accelerations = new_sparse_map(first, element_of(self%response_entry), incidence%response(:, self%response_entry), &
                                          without_bands=without_bands)
    end associate
  end subroutine form_responses

  !> Sets other inertias in one lane of a block. The start speeds stay, so they must not have been projected.
  subroutine update_inertia(self, lane, bodies, inertia, groups, is_indefinite)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: bodies(:)        !! bodies whose inertia changes
    real(wp), intent(in) :: inertia(:)      !! their new inertias [kg m2]
    integer, intent(in) :: groups(:)        !! groups of the machine that contain these bodies
    logical, intent(out) :: is_indefinite   !! the mass matrix is; the parameters of the lane are then invalid
    integer :: g

    is_indefinite = .not. all(inertia > 0)   ! whether a motion without inertia is left is for an assembly to find
    if (is_indefinite) return
    self%machine%inertia(lane, bodies) = inertia
    do g = 1, size(groups)
      call self%machine%coordinates%update_inertia(self%machine%trains, self%machine%groups(groups(g)), &
                                                   self%machine%inertia(lane, :), lane, is_indefinite)
      if (is_indefinite) return
    end do
    call self%incidence%refresh_responses(lane, self%machine%elements, self%machine%coordinates)
    self%accelerations%coefficient(lane, :) = self%incidence%response(lane, self%response_entry)
    call self%element_jacobian%refresh_lane(lane, self%incidence)
    call self%switching%refresh_selected(lane, self%incidence)
  end subroutine update_inertia

  !> Passes the arrays that may differ from variant to variant, without those that `refresh_lane` updates. The formulation must
  !> be a block, or laid out as one.
  subroutine pass_parameters(self, parameters)
    class(reduced_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure([self%states, self%quadratures, self%switches])
    call self%list_coordinates(parameters)
    call self%accelerations%pass_parameters(parameters)
    call self%element_jacobian%pass_parameters(parameters)
  end subroutine pass_parameters

  !> Updates copies and precomputed values after the parameters of a lane have changed.
  subroutine refresh_lane(self, lane)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%refresh_parameters(lane)
    if (self%joints%count > 0) call self%prepare_joints()
  end subroutine refresh_lane

  !> Updates all of that but joints.
  subroutine refresh_parameters(self, lane)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%reset_origin(lane)
    call self%refresh_laws(lane)
  end subroutine refresh_parameters

  !> The same of laws alone; the series copy those that are polynomials.
  subroutine refresh_laws(self, lane)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%machine%refresh_lane(lane)
    call self%state%refresh_lane(self%machine, lane)
    call self%series_kernel%refresh_lane(lane, self%machine%laws, self%twists, self%accelerations)
  end subroutine refresh_laws

  !> q'' = R M, and the derivatives of internal states and work integrals.
  subroutine derivative(self, t, y, dydt, status)
    class(reduced_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)   !! its derivative
    integer, intent(inout) :: status(self%lanes)

    if (self%lanes > 1) then
      call self%series_kernel%derivative(self%state, self%twists, self%accelerations, self%twist_at_origin, t, y, dydt)
      return
    end if
    call fill_derivative(self, self%lanes * self%machine%coordinates%freedoms, self%lanes * self%internal, self%quadratures, &
                         t, y, dydt)
    if (self%joints%count > 0) call self%hold_derivative(self%states + self%quadratures, t(1), dydt, status(1))
  end subroutine derivative

  !> Derivative in arrays of one dimension: speeds, angles, internal states and work integrals follow one another.
  subroutine fill_derivative(self, n, internal, quadratures, t, y, dydt)
    type(reduced_t), intent(inout) :: self
    integer, intent(in) :: n                                                       !! lanes * freedoms
    integer, intent(in) :: internal                                                !! lanes * internal states
    integer, intent(in) :: quadratures                                             !! number of work integrals
    real(wp), intent(in) :: t(self%lanes)                                          !! [s]
    real(wp), intent(in) :: y(2 * n + internal)                                    !! state
    real(wp), intent(inout) :: dydt(2 * n + internal + self%lanes * quadratures)   !! its derivative
    integer :: i

    call self%evaluate_at(n, internal, t, y)
    call add(size(self%moment), self%state%elements%restoring, self%state%elements%applied, self%moment)
    call self%accelerations%multiply(self%moment, dydt)
    do i = 1, n
      dydt(n + i) = y(i)
    end do
    if (internal > 0) call copy(internal, self%state%elements%internal%rate, dydt(2 * n + 1))
    if (quadratures > 0) call self%state%power(self%machine, dydt(2 * n + internal + 1))
  end subroutine fill_derivative

  !> Evaluates the elements at a state.
  subroutine evaluate_at(self, n, internal, t, y)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: n                      !! lanes * freedoms
    integer, intent(in) :: internal               !! lanes * internal states
    real(wp), intent(in) :: t(self%lanes)         !! [s]
    real(wp), intent(in) :: y(2 * n + internal)   !! state

    call self%twists%multiply_pair(self%twist_at_origin, y(n + 1), y(1), self%state%elements%angle, self%state%elements%speed)
    if (allocated(self%driven_rate)) self%state%elements%speed(1, :) = self%state%elements%speed(1, :) + self%driven_rate
    if (internal > 0) call copy(internal, y(2 * n + 1), self%state%elements%internal%value)
    call self%state%evaluate_elements(self%machine, t)
  end subroutine evaluate_at

  !> Every law has a series, but not the moments of rows that move or of teeth with losses.
  subroutine series_obstacle(self, obstacle)
    class(reduced_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
    if (allocated(self%driven_rate)) obstacle = 'bodies that drives turn in a steady state have no motion over the time'
    if (.not. self%joints%only_lock()) obstacle = 'rows that move and teeth with losses have no Taylor series'
  end subroutine series_obstacle

  !> Allocates the recurrence for series up to an order.
  subroutine prepare_series(self, order)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: order

    self%series_kernel = new_reduced_series(self%machine, self%state, self%twists, self%accelerations, self%has_energy_balance, &
                                            order)
    self%held = new_held_lanes(self%lanes, self%joints)
    self%hides_bends = self%machine%has_operation(op_tanh)
  end subroutine prepare_series

  !> Taylor coefficients of the solution through y(:, :, 0).
  subroutine series(self, order, columns, t, y, status)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)                        !! [s]
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)   !! coefficients; number 0 is given
    integer, intent(inout) :: status(self%lanes)

    call self%find_sets(status)
    if (self%compiled%fits(self%series_kernel) .and. .not. self%held%is_active) then
      call self%compiled%expand(self%series_kernel, self%state, self%twist_at_origin, columns, t, y)
      return
    end if
    call self%series_kernel%expand(self%state, self%twists, self%accelerations, self%twist_at_origin, self%incidence, &
                                   self%held, columns, t, y)
  end subroutine series

  !> Writes a program for the Taylor recurrence, after `prepare_series`.
  subroutine write_code(self, code, obstacle)
    class(reduced_t), intent(in) :: self
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable, intent(out) :: obstacle   !! why there is none, ''

    obstacle = code_obstacle(self%series_kernel)
    if (obstacle == '') call write_series_code(self%series_kernel, self%state, self%machine, self%switching, code)
  end subroutine write_code

  !> Writes a program of its own for a block of equal lanes, after `prepare_series`, with the branches of the start.
  subroutine write_program(self, t_start, code, obstacle)
    class(reduced_t), intent(inout) :: self
    real(wp), intent(in) :: t_start   !! [s]
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable, intent(out) :: obstacle   !! why there is none, ''
    real(wp) :: y(self%lanes, self%states)
    type(string_t) :: names(self%states)
    integer :: i

    obstacle = code_obstacle(self%series_kernel)
    if (self%joints%count > 0) obstacle = 'joints that lock or move, and teeth with losses, have no code'
    if (obstacle /= '') return
    if (self%switches > 0) call code%line('/* The laws are those at the start: the program does not follow these boundaries.')
    do i = 1, self%switches
      call code%line('   - @@', a=self%switch_name(i), b=trim(merge(' */', '   ', i == self%switches)))
    end do
    y = self%start()
    do i = 1, self%lanes
      call self%start_lane(i, t_start, y(i, :))
    end do
    do i = 1, self%states
      names(i)%text = self%component_name(i)
    end do
    call write_machine_code(self%series_kernel, self%state, self%twist_at_origin, t_start, y(1, :), names, code)
  end subroutine write_program

  !> Lets series be computed by a program that `write_code` of a block with the same structure has written.
  subroutine attach_code(self, loaded)
    class(reduced_t), intent(inout) :: self
    type(loaded_code_t), intent(in) :: loaded

    call self%compiled%attach(self%series_kernel, self%state, loaded)
  end subroutine attach_code

  !> Whether series are computed by a program, as long as no joint holds.
  pure logical function runs_code(self)
    class(reduced_t), intent(in) :: self

    runs_code = self%compiled%fits(self%series_kernel)
  end function runs_code

  !> Only a program takes steps.
  pure logical function takes_plain_steps(self)
    class(reduced_t), intent(in) :: self

    takes_plain_steps = self%joints%count == 0 .and. self%compiled%fits(self%series_kernel) .and. &
                        (self%switches == 0 .or. self%compiled%follows_switches)
  end function takes_plain_steps

  subroutine take_plain_steps(self, steps)
    class(reduced_t), intent(inout) :: self
    type(plain_steps_t), intent(inout) :: steps

    call self%describe_steps(steps)
    call self%compiled%take_steps(self%series_kernel, self%state, self%twist_at_origin, self%switching, steps)
  end subroutine take_plain_steps

  subroutine change_plain_branches(self, steps)
    class(reduced_t), intent(inout) :: self
    type(plain_steps_t), intent(in) :: steps

    call self%compiled%change_branches(self%machine, self%state, steps)
  end subroutine change_plain_branches

  !> Finds the joints that hold in each lane, and lanes without a motion that fits them.
  subroutine find_sets(self, status)
    class(reduced_t), intent(inout) :: self
    integer, intent(inout) :: status(self%lanes)

    if (self%joints%count == 0) return
    call self%held%take_set(1, self%joints)
    if (self%joints%lost > 0) status(1) = evaluation_fatal
  end subroutine find_sets

  !> Copies an array of any shape, by address.
  pure subroutine copy(n, x, y)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp), intent(inout) :: y(n)

    y = x
  end subroutine copy

  !> Adds arrays of any shape, by address.
  pure subroutine add(n, x, y, sum)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), y(n)
    real(wp), intent(inout) :: sum(n)

    sum = x + y
  end subroutine add

  !> Values of the Jacobian at the positions of `jacobian_pattern`.
  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(reduced_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), contiguous, intent(inout) :: dfdy(:, :)                             !! [lanes, positions]
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)   !! derivative by the time
    integer, intent(inout) :: status(self%lanes)
    integer :: e, f, k

    f = self%machine%coordinates%freedoms
    associate (machine => self%machine, elements => self%state%elements)
      call self%evaluate_at(self%lanes * f, self%lanes * self%internal, t, y)
      if (self%joints%motions%count + self%joints%teeth%count > 0) call self%find_accelerations(t(1), self%acceleration)
      call self%state%differentiate_elements(machine, t)
      if (self%joints%count > 0) then
        call self%differentiate_rows(self%acceleration)
        call self%element_jacobian%fill(machine%elements%internal, elements, self%free_jacobian)
      else
        call self%element_jacobian%fill(machine%elements%internal, elements, dfdy)
      end if
      call self%accelerations%multiply(elements%applied_time, dfdt)
      dfdt(:, f + 1:2 * f) = 0.0_wp
      dfdt(:, 2 * f + 1:self%states) = elements%internal%rate_time
      do k = 1, self%quadratures
        e = machine%with_work(k)
        dfdt(:, self%states + k) = elements%applied_time(:, e) * elements%speed(:, e)
      end do
      if (self%joints%count > 0) call self%hold_jacobian(self%states + self%quadratures, dfdy, dfdt)
    end associate
  end subroutine jacobian

  !> The Jacobian where joints hold: each column has the accelerations that these leave.
  subroutine hold_jacobian(self, components, dfdy, dfdt)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: components                                       !! states + quadratures
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)    !! of one lane
    real(wp), intent(inout) :: dfdt(self%lanes, components)

    call self%spread_jacobian(components, dfdy)
    call self%hold_columns(components, dfdy, dfdt)
  end subroutine hold_jacobian

  !> The Jacobian without joints at all positions.
  subroutine spread_jacobian(self, components, dfdy)
    class(reduced_t), intent(in) :: self
    integer, intent(in) :: components                                       !! states + quadratures
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)
    integer :: k

    dfdy = 0.0_wp
    associate (pattern => self%element_jacobian%pattern)
      do k = 1, size(pattern%row)
        dfdy(:, pattern%row(k), pattern%column(k)) = self%free_jacobian(:, k)
      end do
    end associate
  end subroutine spread_jacobian

  !> All positions where there are joints.
  function jacobian_pattern(self) result(pattern)
    class(reduced_t), intent(in) :: self
    type(pattern_t) :: pattern
    integer :: i, j

    pattern = self%element_jacobian%pattern
    if (self%joints%count == 0) return
    associate (components => self%states + self%quadratures)
      pattern = pattern_t([((i, i=1, components), j=1, self%states)], [((j, i=1, components), j=1, self%states)])
    end associate
  end function jacobian_pattern

end module nocdyn_reduced
