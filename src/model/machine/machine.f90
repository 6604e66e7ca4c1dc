!> A machine: bodies, banks of elements, constraints and the coordinates that they leave, on a block of lanes.
module nocdyn_machine
  use nocdyn_bank, only: bank_slot_t, bank_t, role_names
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_elements, only: elements_t, new_elements
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_polynomial_laws, only: new_polynomial_laws, polynomial_laws_t
  use nocdyn_rigid_trains, only: rigid_trains_t
  use nocdyn_switches, only: new_switches, switches_t
  use nocdyn_text, only: quoted, string_t
  implicit none (type, external)
  private

  !> What happened to start speeds that violated constraints and were projected.
  type, public :: start_shock_t
    integer, allocatable :: row(:)            !! those with an impulse: violated ones, and others geared to them
    real(wp), allocatable :: impulse(:)       !! in each of them, [unit of its multiplier * s]
    real(wp) :: energy_lost = 0.0_wp          !! [J]
  end type start_shock_t

  type, public :: machine_t
    integer :: lanes = 1
    integer :: bodies = 0
    type(string_t), allocatable :: names(:)         !! of the bodies
    real(wp), allocatable :: inertia(:, :)          !! J [kg m2], shape [lanes, bodies]
    real(wp), allocatable :: start_angle(:, :)      !! [rad]
    real(wp), allocatable :: start_speed(:, :)      !! [rad/s], obeys the constraints
    type(start_shock_t), allocatable :: shock       !! if the start speeds of the input had to be projected
    type(bank_slot_t), allocatable :: banks(:)
    type(elements_t) :: elements                    !! of all banks, after `number_elements`
    type(polynomial_laws_t) :: laws                 !! what of their laws is polynomial, after `number_elements`
    integer, allocatable :: other_banks(:)          !! those whose laws are more than that
    integer, allocatable :: inner_banks(:)          !! those whose elements have inner states
    type(switches_t) :: switches                    !! of all banks, after `number_elements`
    integer, allocatable :: accounted(:)            !! elements whose power may be integrated, [accounts]
    type(constraints_t) :: constraints
    type(rigid_trains_t) :: trains
    type(geared_group_t), allocatable :: groups(:)
    type(coordinates_t) :: coordinates
  contains
    procedure :: number_elements
    procedure :: list_numbers
    procedure :: settle
    procedure :: elastic
    procedure :: element_name
    procedure :: start_inner
    procedure :: inner_name
    procedure :: choose_all
    procedure :: accounts
    procedure :: accounted_name
    procedure :: evaluate
    procedure :: evaluate_elements
    procedure :: differentiate
    procedure :: differentiate_elements
    procedure :: assess
    procedure :: series_obstacle
    procedure :: power
    procedure :: kinetic_energy
    procedure :: stored_energy
  end type machine_t

contains

  !> Numbers the elements of all banks through; to be called once the banks are there.
  subroutine number_elements(self)
    class(machine_t), intent(inout) :: self
    integer :: i, inner, total

    total = 0
    inner = 0
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        bank%first = total + 1
        bank%first_value = self%lanes * total + 1
        bank%first_inner = inner + 1
        bank%first_inner_value = self%lanes * inner + 1
        total = bank%last()
        inner = inner + bank%inner * size(bank%to)
      end associate
    end do
    self%elements = new_elements(self%lanes, [(self%banks(i)%bank%from, i=1, size(self%banks))], &
                                 [(self%banks(i)%bank%to, i=1, size(self%banks))], &
                                 [(spread(self%banks(i)%bank%inner, 1, size(self%banks(i)%bank%to)), i=1, size(self%banks))])
    self%laws = new_polynomial_laws(self%lanes, total)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%polynomials(self%laws)
    end do
    call self%laws%divide()
    self%other_banks = pack([(i, i=1, size(self%banks))], [(self%banks(i)%bank%values > 0 .and. &
                                                            .not. self%banks(i)%bank%is_polynomial, i=1, size(self%banks))])
    self%inner_banks = pack([(i, i=1, size(self%banks))], [(self%banks(i)%bank%inner_values > 0, i=1, size(self%banks))])
    self%accounted = [(self%banks(i)%bank%first - 1 + self%banks(i)%bank%accounted, i=1, size(self%banks))]
    self%switches = new_switches(self%banks)
  end subroutine number_elements

  !> Lists what may differ from variant to variant.
  subroutine list_numbers(self, numbers)
    class(machine_t), target, intent(inout) :: self
    type(lane_numbers_t), intent(inout) :: numbers
    integer :: i

    call numbers%remark(self%bodies)
    call numbers%add('machine: inertia', self%inertia)
    call numbers%add('machine: start_angle', self%start_angle)
    call numbers%add('machine: start_speed', self%start_speed)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%list_layout(numbers)
      call self%banks(i)%bank%list_numbers(numbers)
    end do
    call self%laws%list_numbers(numbers)
    call self%constraints%list_numbers(numbers)
    call self%coordinates%list_numbers(numbers)
  end subroutine list_numbers

  !> Leaves the mean torques of a machine that has run for long; to be evaluated at a late time.
  subroutine settle(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%banks)
      call self%banks(i)%bank%settle()
    end do
    call self%number_elements()
  end subroutine settle

  !> The elements that can have a restoring moment.
  pure function elastic(self) result(elements)
    class(machine_t), intent(in) :: self
    integer, allocatable :: elements(:)
    integer :: i

    elements = [(self%banks(i)%bank%first - 1 + self%banks(i)%bank%elastic, i=1, size(self%banks))]
  end function elastic

  !> The inner states at the start, [lanes, inner states].
  function start_inner(self) result(inner)
    class(machine_t), intent(in) :: self
    real(wp), allocatable :: inner(:, :)
    real(wp) :: omega(self%lanes, 0:self%bodies)
    integer :: i

    allocate (inner(self%lanes, self%elements%inner%count), source=0.0_wp)
    omega(:, 0) = 0.0_wp
    omega(:, 1:) = self%start_speed
    do i = 1, size(self%inner_banks)
      associate (bank => self%banks(self%inner_banks(i))%bank)
        call bank%start_inner(omega(:, bank%to) - omega(:, bank%from), &
                              inner(:, bank%first_inner:bank%first_inner + bank%inner * size(bank%to) - 1))
      end associate
    end do
  end function start_inner

  !> E.g. "armature current of 'drive'".
  function inner_name(self, index) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to elements%inner%count
    character(len=:), allocatable :: name
    integer :: i

    do i = 1, size(self%inner_banks)
      associate (bank => self%banks(self%inner_banks(i))%bank)
        associate (place => index - bank%first_inner)
          if (place >= bank%inner * size(bank%to)) cycle
          name = bank%inner_name(1 + modulo(place, bank%inner)) // ' of ' // trim(role_names(bank%role)) // ' ' // &
                 quoted(bank%names(1 + place / bank%inner)%text)
          return
        end associate
      end associate
    end do
    error stop 'nocdyn_machine: there are not so many inner states'
  end function inner_name

  !> Chooses the branches of all lanes, from the inner states in `elements`.
  subroutine choose_all(self, t, phi, omega)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)   !! [lanes, ground and bodies]
    integer :: k, lane

    associate (switches => self%switches, inner => self%elements%inner%value)
      do k = 1, switches%count
        associate (from => self%elements%from(switches%element(k)), to => self%elements%to(switches%element(k)))
          do lane = 1, self%lanes
            call switches%choose(self%banks, k, lane, t(lane), phi(lane, to) - phi(lane, from), &
                                 omega(lane, to) - omega(lane, from), &
                                 inner(lane, switches%first_inner(k):switches%last_inner(k)))
          end do
        end associate
      end do
    end associate
  end subroutine choose_all

  !> How many elements may have their power integrated.
  pure integer function accounts(self)
    class(machine_t), intent(in) :: self

    accounts = size(self%accounted)
  end function accounts

  !> Name of the element whose power is integrated as number `index`.
  pure function accounted_name(self, index) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to accounts
    character(len=:), allocatable :: name

    name = self%element_name(self%accounted(index))
  end function accounted_name

  pure function element_name(self, element) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: element
    character(len=:), allocatable :: name
    integer :: i

    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        if (element <= bank%last()) then
          name = bank%names(element - bank%first + 1)%text
          return
        end if
      end associate
    end do
    error stop 'nocdyn_machine: there are not so many elements'
  end function element_name

  !> The torques T = Q + C omega + K phi of all elements on the bodies, the right-hand side of eq. (12) without reactions.
  subroutine evaluate(self, t, phi, omega, torque)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)   !! [lanes, ground and bodies]
    real(wp), contiguous, intent(inout) :: torque(:, 0:)

    call self%elements%gather(phi, omega)
    call self%evaluate_elements(t)
    call self%elements%scatter(torque)
  end subroutine evaluate

  !> The moments of all elements from their angles and speeds.
  subroutine evaluate_elements(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    integer :: i

    call self%laws%evaluate(self%elements)
    do i = 1, size(self%other_banks)
      associate (bank => self%banks(self%other_banks(i))%bank, elements => self%elements)
        call evaluate_bank(bank, size(elements%angle), t, elements%angle, elements%speed, elements%restoring, elements%working)
      end associate
    end do
    if (self%elements%inner%count == 0) return
    do i = 1, size(self%inner_banks)
      associate (bank => self%banks(self%inner_banks(i))%bank, elements => self%elements, inner => self%elements%inner)
        call evaluate_inner_of_bank(bank, size(elements%angle), size(inner%value), elements%speed, inner%value, &
                                    elements%working, inner%rate)
      end associate
    end do
  end subroutine evaluate_elements

  !> Hands a bank its part of the values, by address alone.
  subroutine evaluate_bank(bank, n, t, angle, speed, restoring, working)
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: n   ! lanes * elements
    real(wp), intent(in) :: t(bank%lanes), angle(n), speed(n)
    real(wp), intent(inout) :: restoring(n), working(n)

    associate (first => bank%first_value)
      call bank%evaluate(t, angle(first), speed(first), restoring(first), working(first))
    end associate
  end subroutine evaluate_bank

  subroutine evaluate_inner_of_bank(bank, n, inner_values, speed, inner, working, rate)
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: n              ! lanes * elements
    integer, intent(in) :: inner_values   ! lanes * inner states
    real(wp), intent(in) :: speed(n), inner(inner_values)
    real(wp), intent(inout) :: working(n), rate(inner_values)

    associate (first => bank%first_value, first_inner => bank%first_inner_value)
      call bank%evaluate_inner(speed(first), inner(first_inner), working(first), rate(first_inner))
    end associate
  end subroutine evaluate_inner_of_bank

  !> The moments of all elements and their derivatives.
  subroutine differentiate(self, t, phi, omega)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)   !! [lanes, ground and bodies]

    call self%elements%gather(phi, omega)
    call self%evaluate_elements(t)
    call self%differentiate_elements(t)
  end subroutine differentiate

  !> The derivatives of the moments, after `evaluate_elements`.
  subroutine differentiate_elements(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    integer :: i

    self%elements%time(:) = t
    call self%laws%differentiate(self%elements)
    do i = 1, size(self%other_banks)
      call self%banks(self%other_banks(i))%bank%differentiate(self%elements)
    end do
  end subroutine differentiate_elements

  !> Stored energies, secant stiffnesses and dampings of all elements from their angles.
  subroutine assess(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    call self%laws%assess(self%elements)
    do i = 1, size(self%other_banks)
      call self%banks(self%other_banks(i))%bank%assess(self%elements)
    end do
  end subroutine assess

  !> The first element that has no Taylor series, as a sentence; empty if all have one.
  function series_obstacle(self) result(obstacle)
    class(machine_t), intent(in) :: self
    character(len=:), allocatable :: obstacle
    integer :: i

    obstacle = ''
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        if (size(bank%to) == 0 .or. bank%has_series()) cycle
        obstacle = trim(role_names(bank%role)) // ' ' // quoted(bank%names(1)%text) // ' has no Taylor series'
        return
      end associate
    end do
  end function series_obstacle

  !> Power of the accounted elements after `evaluate`, positive into the machine [W].
  subroutine power(self, watts)
    class(machine_t), intent(in) :: self
    real(wp), intent(inout) :: watts(self%lanes, size(self%accounted))
    integer :: e, k, l

    do k = 1, size(self%accounted)
      e = self%accounted(k)
      do l = 1, self%lanes
        watts(l, k) = self%elements%working(l, e) * self%elements%speed(l, e)
      end do
    end do
  end subroutine power

  !> omega^T J omega / 2 of one lane [J].
  pure function kinetic_energy(self, lane, omega) result(energy)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: omega(:)   !! [bodies]
    real(wp) :: energy

    energy = 0.5_wp * sum(self%inertia(lane, :) * omega**2)
  end function kinetic_energy

  !> Potential energy in the elements of one lane, at the angles of the last `evaluate` [J].
  function stored_energy(self, lane) result(energy)
    class(machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp) :: energy

    call self%assess()
    energy = sum(self%elements%stored(lane, :))
  end function stored_energy

end module nocdyn_machine
