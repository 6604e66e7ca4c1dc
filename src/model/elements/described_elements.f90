!> Elements with the same form of law: their parameters, the law, and its branches.
!>
!> The polynomial part of the law is given as multiples of parameters, which one loop evaluates for all elements of a machine
!> (`polynomial_laws_t`); the rest is written once, as formulas in `describe`, from which moments, rates, derivatives, energies,
!> Taylor series and the choice of branches follow (`element_law_t`).
!>
!> An element may have a *phase*: another element, which belongs to a bank of its own that follows, and whose angle and speed the
!> law reads beside its own. The law gives a moment for both. The phases of a bank follow one another as its elements do.
!>
!> An element may have *internal states*, for instance the integral of a governor or an armature current. Their rates depend
!> on the speed of the element, on its internal states and on the time only. All elements have the same number of them.
!>
!> A law with kinks or jumps has *branches*: on each branch it is one smooth formula that may be evaluated anywhere. A branch
!> selects constants of the formulas (`pick`), or a segment of a curve; guards, which tell where a branch holds, contain no picks.
!> Only `choose` changes a branch. The branches divide the plane of the law's variables, so the branch follows from the state and
!> a law has no memory. Every boundary of a branch is shifted outwards by `boundary_width`, relative to the scale of the law: a
!> lane that has just crossed it is well inside its new branch.
module nocdyn_described_elements
  use nocdyn_curves, only: curve_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_element_laws, only: element_law_t, new_element_law
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_law_expressions, only: expression_t, parameter_of
  use nocdyn_law_tape, only: at_element, law_tape_t, new_law_tape
  use nocdyn_law_waves, only: take_means
  use nocdyn_laws, only: law_parameter_t, strip_lanes
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: time_reached

  real(wp), parameter, public :: never = 1.0e60_wp   !! later than all times, of what does not begin or end [s]
  real(wp), parameter, public :: boundary_width = 1.0e-10_wp   !! shift of branch boundaries, relative to the scale of a law

  integer, parameter, public :: stays_as_mean = 1   !! what of a torque is in a steady state: its mean over waves, ...
  integer, parameter, public :: stays_whole = 2     !! ... all of it, as its changes end or belong to a motion ...
  integer, parameter, public :: stays_away = 3      !! ... or nothing

  !> A coefficient of the polynomial part of a law: a multiple of a parameter.
  type, public :: polynomial_term_t
    integer :: parameter = 0      !! its number
    integer :: coefficient = 0    !! coefficient_... of `nocdyn_polynomial_laws`
    real(wp) :: factor = 1.0_wp
  end type polynomial_term_t

  type, public :: described_elements_t
    integer :: lanes = 1
    integer :: count = 0                          !! elements
    integer :: first = 1                          !! number of the first one in the machine
    integer :: values = 0                         !! lanes * elements
    logical :: is_polynomial = .true.             !! whether `polynomials` gives the moments
    logical :: has_described_rows = .false.       !! whether formulas give rows that move (`nocdyn_described_rows`)
    integer :: states = 0                         !! internal states of each element
    integer :: ports = at_element                 !! `at_phase` if the elements have phases
    real(wp) :: phase_order = 0.0_wp              !! most oscillations of a law per turn of its phase
    integer :: steady_part = stays_as_mean        !! stays_...
    logical, private :: is_mean = .false.         !! whether the law is the one of steady states, after `describe_mean`
    logical, private :: turns = .true.            !! whether its angle advances there
    integer :: internal_values = 0                !! lanes * states * elements
    integer, allocatable :: switch_element(:)     !! element of each switch
    character(len=24), allocatable :: switch_names(:)   !! of the boundaries, e.g. 'edge of the gap', [switches]
    integer, allocatable :: choices(:)            !! branches of each switch, [switches]; 0: the segments of `curve`; negative:
                                                  !! something else than guards chooses them
    integer, allocatable :: branch(:, :)          !! present branch of each switch, 1 or more, or a segment; [lanes, switches]
    integer, allocatable, private :: kept_branch(:, :)   !! after `keep_branches`
    type(law_parameter_t), allocatable :: parameters(:)
    type(polynomial_term_t), allocatable :: terms(:)   !! of the polynomial part of the law
    type(curve_t), allocatable :: curve(:, :)     !! of the first switch of each element, [lanes, elements]
    type(element_law_t), allocatable :: law       !! the part that is not polynomial
  contains
    procedure :: polynomials
    procedure :: describe
    procedure :: set_size
    procedure :: add_key
    procedure :: add_parameter
    procedure :: add_parts, part_columns
    procedure :: values_of
    procedure :: add_term
    procedure :: number_of
    procedure :: parameter
    procedure :: add_switches
    procedure :: prepare_law
    procedure :: describe_mean
    procedure :: refresh_lane
    procedure :: evaluate
    procedure :: choose
    procedure :: set_branch
    procedure :: keep_branches, restore_branches
    procedure :: indicator
    procedure :: block_indicators
    procedure :: fastest_wave
    procedure :: pass_parameters
  end type described_elements_t

contains

  !> Sets the numbers of lanes and elements, which have no parameters yet.
  subroutine set_size(self, lanes, count)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: lanes, count

    self%lanes = lanes
    self%count = count
    self%values = lanes * count
    self%internal_values = lanes * self%states * count
    allocate (self%parameters(0), self%terms(0))
    allocate (self%switch_element(0), self%switch_names(0), self%choices(0), self%branch(lanes, 0))
  end subroutine set_size

  !> The time to compare with the times at which a law changes: later by some roundings, by which a step may end too early.
  pure function time_reached(t)
    real(wp), intent(in) :: t   !! [s]
    real(wp) :: time_reached    !! [s]

    time_reached = t + 8.0_wp * spacing(t)
  end function time_reached

  !> Adds the values of a key as parameters with its name.
  subroutine add_key(self, keys, key, absent)
    class(described_elements_t), intent(inout) :: self
    class(element_keys_t), intent(in) :: keys
    character(len=*), intent(in) :: key
    real(wp), intent(in), optional :: absent   !! where it has no value; absent: 0

    call self%add_parameter(key, keys%values(key, absent))
  end subroutine add_key

  !> Adds an array of parameters, one column for each element unless `element` says otherwise.
  subroutine add_parameter(self, name, value, is_key, element)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: value(:, :)          !! in the unit of the key, [lanes, columns]
    logical, intent(in), optional :: is_key      !! whether these are the values of the key with this name; absent: they are
    integer, intent(in), optional :: element(:)  !! of each column, numbered within the bank
    type(law_parameter_t), allocatable :: longer(:)
    integer :: e, n

    n = size(self%parameters)
    allocate (longer(n + 1))
    longer(:n) = self%parameters
    longer(n + 1)%name = name
    longer(n + 1)%is_key = .true.
    if (present(is_key)) longer(n + 1)%is_key = is_key
    allocate (longer(n + 1)%value, source=value)
    allocate (longer(n + 1)%element(size(value, 2)))
    longer(n + 1)%element(:) = [(e, e=1, size(value, 2))]
    if (present(element)) longer(n + 1)%element(:) = element
    call move_alloc(longer, self%parameters)
  end subroutine add_parameter

  !> Adds an array of parameters in parts, such as the terms of a sum, sorted by them; they are not the values of a key.
  subroutine add_parts(self, name, value)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: value(:, :, :)   !! [lanes, elements, parts]
    integer :: e, k

    call self%add_parameter(name, reshape(value, [size(value, 1), size(value, 2) * size(value, 3)]), is_key=.false., &
                            element=[((e, e=1, size(value, 2)), k=1, size(value, 3))])
  end subroutine add_parts

  !> The columns of a part of all elements, see `add_parts`.
  pure function part_columns(self, part) result(columns)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: part
    integer :: columns(self%count)
    integer :: e

    columns = [(e + (part - 1) * self%count, e=1, self%count)]
  end function part_columns

  !> Number of a parameter; 0 if there is none.
  pure integer function number_of(self, name)
    class(described_elements_t), intent(in) :: self
    character(len=*), intent(in) :: name

    do number_of = size(self%parameters), 1, -1
      if (self%parameters(number_of)%name == name) return
    end do
  end function number_of

  !> The values of a parameter, [lanes, columns].
  pure function values_of(self, name) result(values)
    class(described_elements_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), allocatable :: values(:, :)

    allocate (values, source=self%parameters(self%number_of(name))%value)
  end function values_of

  !> Adds a coefficient of the polynomial part of the law.
  subroutine add_term(self, parameter, coefficient, factor)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: parameter   !! its name
    integer, intent(in) :: coefficient          !! coefficient_...
    real(wp), intent(in) :: factor              !! by which the parameter is multiplied

    self%terms = [self%terms, polynomial_term_t(self%number_of(parameter), coefficient, factor)]
  end subroutine add_term

  !> A parameter in the formulas of a law: of each element its own column, or the one of a list.
  function parameter(self, tape, name, columns)
    class(described_elements_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in), optional :: columns(:)   !! of each element, 0 for the value zero
    type(expression_t) :: parameter
    integer :: e

    if (present(columns)) then
      parameter = parameter_of(tape, number_of(self, name), columns)
    else
      parameter = parameter_of(tape, number_of(self, name), [(e, e=1, self%count)])
    end if
  end function parameter

  !> Gives every element one more switch, which is on its first branch until `choose` sets it.
  subroutine add_switches(self, names, choices)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: names(:)   !! of the boundaries, [elements]
    integer, intent(in) :: choices             !! as in the type
    integer :: e

    self%switch_names = [character(len=len(self%switch_names)) :: self%switch_names, names]
    self%switch_element = [self%switch_element, (e, e=1, self%count)]
    self%choices = [self%choices, spread(choices, 1, self%count)]
    deallocate (self%branch)
    allocate (self%branch(self%lanes, size(self%switch_element)), source=1)
  end subroutine add_switches

  !> Records the law and computes its constants. Every constructor of a bank that overrides `describe` calls it at the end.
  subroutine prepare_law(self, elements)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in), optional :: elements   !! of the machine; absent: as for the bank
    type(law_tape_t), target :: tape
    integer :: all_elements, lane

    all_elements = self%count
    if (present(elements)) all_elements = elements
    if (allocated(self%law)) then
      if (present(elements) .and. self%law%law%strip == strip_lanes(self%lanes, all_elements)) return
      deallocate (self%law)
    end if
    if (self%is_polynomial .and. .not. self%has_described_rows .or. self%values == 0) return
    tape = new_law_tape(self%states)
    call self%describe(tape)
    if (self%is_mean) call take_means(tape, self%turns)
    if (self%is_mean .and. self%steady_part == stays_away) tape%applied = 0
    allocate (self%law, source=new_element_law(tape, self%lanes, self%count, self%states, &
                                               strip_lanes(self%lanes, all_elements)))
    do lane = 1, self%lanes
      call self%refresh_lane(lane)
    end do
  end subroutine prepare_law

  !> Replaces the law by the one of steady states.
  subroutine describe_mean(self, turns)
    class(described_elements_t), intent(inout) :: self
    logical, intent(in) :: turns   !! whether its angle advances, else it is a twist that stays

    if (self%steady_part == stays_whole .or. .not. allocated(self%law)) return
    if (.not. self%law%has_waves) return
    self%is_mean = .true.
    self%turns = turns
    call self%prepare_law()
  end subroutine describe_mean

  !> Computes the constants of the law again, after a change of the parameters of a lane.
  subroutine refresh_lane(self, lane)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: e

    if (.not. allocated(self%law)) return
    do e = 1, self%count
      call refresh_element(self, lane, e, .false.)
    end do
  end subroutine refresh_lane

  subroutine refresh_element(self, lane, element, is_branch_only)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: lane, element
    logical, intent(in) :: is_branch_only   !! whether the parameters are as before

    associate (branch => self%branch(lane, element::self%count), law => self%law)
      if (allocated(self%curve)) then
        call law%refresh(lane, element, self%parameters, branch, is_branch_only, self%curve(lane, element))
      else
        call law%refresh(lane, element, self%parameters, branch, is_branch_only)
      end if
    end associate
  end subroutine refresh_element

  !> Lists the parameter arrays of its elements, and the operations of its law.
  subroutine pass_parameters(self, parameters)
    class(described_elements_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: i

    do i = 1, size(self%parameters)
      associate (one => self%parameters(i))
        call parameters%add(trim(one%name), one%value)
      end associate
    end do
    if (allocated(self%curve)) call parameters%add_curves(self%curve)
    if (.not. (allocated(self%law) .and. parameters%describes)) return
    associate (node => self%law%law%tape%node, count => self%law%law%tape%count)
      call parameters%add_structure([(node(i)%operation, i=1, count)], [(node(i)%a, i=1, count)], [(node(i)%b, i=1, count)], &
                                    self%law%law%tape%list)
    end associate
  end subroutine pass_parameters

  !> Sets the coefficients of its elements among the ones of the machine, which are zero before, in some lanes.
  pure subroutine polynomials(self, first_lane, last_lane, laws)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: first_lane, last_lane
    type(polynomial_laws_t), intent(inout) :: laws   !! of the machine
    integer :: e, i, l

    do i = 1, size(self%terms)
      associate (term => self%terms(i))
        do e = 1, self%count
          do l = first_lane, last_lane
            call laws%set(term%coefficient, l, self%first - 1 + e, term%factor * self%parameters(term%parameter)%value(l, e))
          end do
        end do
      end associate
    end do
  end subroutine polynomials

  !> Writes the part of the law that is not polynomial as formulas: sets `restoring`, `applied`, `stored`, `rate`, `row` of the
  !> list and the guards of its branches. By default there is none.
  subroutine describe(self, tape)
    class(described_elements_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (tape%count > 0 .or. self%values > 0) then
      error stop 'nocdyn_described_elements: elements that are not polynomial override describe'
    end if
  end subroutine describe

  !> Adds the part of the law that is not polynomial to the moments of the elements, and sets the rates of the internal
  !> states. All arrays but `time` are flat: the lanes of its first element, then the ones of its second, and so on.
  subroutine evaluate(self, time, angle, speed, internal, restoring, applied, rate)
    class(described_elements_t), intent(inout) :: self
    real(wp), intent(in) :: time(self%lanes)                                      !! t [s]
    real(wp), intent(in), dimension(self%values * self%ports) :: angle, speed     !! u [rad], u' [rad/s]; phases come last
    real(wp), intent(in) :: internal(self%internal_values)                        !! [lanes, states, elements]
    real(wp), intent(inout), dimension(self%values * self%ports) :: restoring, applied   !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)                     !! of the internal states

    if (allocated(self%law)) call self%law%evaluate(time, angle, speed, internal, restoring, applied, rate)
  end subroutine evaluate

  !> Sets the branch of a switch in one lane to the one that contains the state.
  subroutine choose(self, switch, lane, t, motion_of_element, internal)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: motion_of_element(4)   !! u [rad], u' [rad/s] of the switching element, and of its phase
    real(wp), intent(in) :: internal(:)    !! its internal states
    real(wp) :: best, inside, motion(5)
    integer :: before, i, slot

    if (self%choices(switch) < 0) return
    if (.not. self%law%is_ready) call self%law%make_ready()
    associate (branch => self%branch(lane, switch), e => self%switch_element(switch), numbers => self%law%numbers)
      before = branch
      slot = self%law%law%slot(lane, e)
      motion = [time_reached(t), motion_of_element]
      if (self%choices(switch) == 0) then
        call numbers%curve_argument(slot, motion(:3), internal, inside)
        branch = self%curve(lane, e)%segment(inside)
      else
        best = -huge(best)
        do i = 1, self%choices(switch)
          call numbers%lowest_guard(slot, number_in_element(self, switch), i, motion, internal, .false., inside)
          if (inside <= best) cycle
          best = inside
          branch = i
          if (best > 0) exit
        end do
      end if
      if (branch /= before) call refresh_element(self, lane, e, .true.)
    end associate
  end subroutine choose

  !> Sets the branch of a switch in one lane.
  subroutine set_branch(self, switch, lane, branch)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: switch   !! numbered within the bank
    integer, intent(in) :: lane, branch

    if (self%branch(lane, switch) == branch) return
    self%branch(lane, switch) = branch
    call refresh_element(self, lane, self%switch_element(switch), .true.)
  end subroutine set_branch

  !> Keeps the present branches, to which `restore_branches` goes back.
  subroutine keep_branches(self)
    class(described_elements_t), intent(inout) :: self

    self%kept_branch = self%branch
  end subroutine keep_branches

  subroutine restore_branches(self)
    class(described_elements_t), intent(inout) :: self
    integer :: lane, switch

    do switch = 1, size(self%kept_branch, 2)
      do lane = 1, size(self%kept_branch, 1)
        call self%set_branch(switch, lane, self%kept_branch(lane, switch))
      end do
    end do
  end subroutine restore_branches

  !> Number of a switch among the ones of its element.
  pure integer function number_in_element(self, switch)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: switch   !! numbered within the bank

    number_in_element = (switch - 1) / self%count + 1
  end function number_in_element

  !> Distance of a lane from the nearest boundary of its present branch, in a unit of the law: continuous, negative beyond.
  subroutine indicator(self, switch, lane, motion, internal, distance)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: motion(5)      !! t [s], u [rad], u' [rad/s] of the switching element, and of its phase
    real(wp), intent(in) :: internal(:)    !! its internal states
    real(wp), intent(out) :: distance

    if (.not. self%law%is_ready) call self%law%make_ready()
    call self%law%numbers%lowest_guard(self%law%law%slot(lane, self%switch_element(switch)), number_in_element(self, switch), &
                                       self%branch(lane, switch), motion, internal, .true., distance)
  end subroutine indicator

  !> Indicators of all switches in all lanes of a block.
  subroutine block_indicators(self, time, angle, speed, internal, distance)
    class(described_elements_t), intent(inout) :: self
    real(wp), intent(in) :: time(self%lanes)                         !! t [s]
    real(wp), intent(in), dimension(self%values * self%ports) :: angle, speed   !! u [rad], u' [rad/s]; phases come last
    real(wp), intent(in) :: internal(self%internal_values)           !! [lanes, states, elements]
    real(wp), intent(inout) :: distance(:, :)                        !! [lanes, switches]

    call self%law%lowest_guards(self%branch, time, angle, speed, internal, distance)
  end subroutine block_indicators

  !> The largest rate at which the moments of one lane oscillate with the time or an angle [rad/s]: the one of the sines of the
  !> law.
  pure real(wp) function fastest_wave(self, lane, speed)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: speed(:)   !! u' of the elements, then of their phases [rad/s]

    fastest_wave = 0.0_wp
    if (allocated(self%law)) fastest_wave = self%law%fastest(lane, speed)
  end function fastest_wave

end module nocdyn_described_elements
