!> States of a machine that satisfy its gear constraints, and the same states in each formulation.
module nocdyn_test_states
  use nocdyn_body_formulation, only: body_formulation_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_multiplier, only: multiplier_t
  use nocdyn_paper, only: paper_t
  use nocdyn_paper_matrices, only: elastic_moments
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_test_random, only: random_stream, random_stream_t
  implicit none (type, external)
  private

  public :: draw_state, state_of, bring_to, enter_all, formulate, reduced_form

  !> The formulations of `formulate`, for loops.
  integer, parameter, public :: reduced = 1, paper = 2, multiplier = 3

contains

  subroutine formulate(machine, which, formulation, with_energy_balance)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: which   !! `reduced`, `paper` or `multiplier`
    class(formulation_t), allocatable, intent(out) :: formulation
    logical, intent(in), optional :: with_energy_balance   !! whether work is integrated; absent: yes
    logical :: has_works

    has_works = .true.
    if (present(with_energy_balance)) has_works = with_energy_balance
    select case (which)
    case (reduced)
      allocate (reduced_t :: formulation)
    case (paper)
      allocate (paper_t :: formulation)
    case default
      allocate (multiplier_t :: formulation)
    end select
    formulation%machine = machine
    call formulation%formulate(has_works)
  end subroutine formulate

  !> As `new_reduced`, polymorphic as the machines of `nocdyn_test_machines`.
  function reduced_form(machine, with_energy_balance, as_block) result(form)
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: with_energy_balance
    logical, intent(in), optional :: as_block
    class(reduced_t), allocatable :: form

    form = new_reduced(machine, with_energy_balance, as_block)
  end function reduced_form

  !> Random angles and speeds that satisfy the gear constraints, [lanes, ground and bodies].
  subroutine draw_state(machine, seed, phi, omega)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: seed
    real(wp), allocatable, intent(out) :: phi(:, :), omega(:, :)
    type(random_stream_t) :: stream
    real(wp) :: speed(machine%coordinates%freedoms), twist(machine%coordinates%freedoms)
    integer :: i, l

    stream = random_stream(seed)
    allocate (phi(machine%lanes, 0:machine%bodies), omega(machine%lanes, 0:machine%bodies), source=0.0_wp)
    do l = 1, machine%lanes
      do i = 1, size(speed)
        speed(i) = stream%number(-3.0_wp, 3.0_wp)
        twist(i) = stream%number(-1.0_wp, 1.0_wp)
      end do
      phi(l, 1:) = machine%start_angle(l, :) + matmul(machine%coordinates%complement(l), twist)
      omega(l, 1:) = matmul(machine%coordinates%complement(l), speed)
    end do
  end subroutine draw_state

  !> The state vector of a formulation for given angles and speeds, with work integrals of zero, [lanes, states + quadratures].
  !> The internal states are between 0.2 and 0.8.
  function state_of(formulation, phi, omega) result(y)
    class(formulation_t), intent(in) :: formulation
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)   !! [lanes, ground and bodies]
    real(wp), allocatable :: y(:, :)
    integer :: s

    allocate (y(formulation%lanes, formulation%states + formulation%quadratures), source=0.0_wp)
    y(:, formulation%mechanical + 1:formulation%states) = &
      spread([(0.5_wp + 0.3_wp * sin(real(s, wp)), s=1, formulation%internal)], 1, formulation%lanes)
    select type (formulation)
    type is (reduced_t)
      call place_coordinates(formulation%machine, phi, omega, y)
    class is (body_formulation_t)
      y(:, :formulation%machine%bodies) = omega(:, 1:)
      y(:, formulation%machine%bodies + 1:2 * formulation%machine%bodies) = phi(:, 1:)
      if (formulation%mechanical > 2 * formulation%machine%bodies) call place_moments(formulation%machine, phi, omega, y)
    end select
  end function state_of

  subroutine place_coordinates(machine, phi, omega, y)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: phi(:, 0:), omega(:, 0:)
    real(wp), intent(inout) :: y(:, :)
    integer :: l

    associate (f => machine%coordinates%freedoms)
      do l = 1, machine%lanes
        call machine%coordinates%project(l, machine%inertia(l, :), omega(l, 1:), y(l, :f))
        call machine%coordinates%project(l, machine%inertia(l, :), phi(l, 1:) - machine%start_angle(l, :), y(l, f + 1:2 * f))
      end do
    end associate
  end subroutine place_coordinates

  !> The states F of the paper's formulation.
  subroutine place_moments(machine, phi, omega, y)
    type(machine_t), intent(in) :: machine
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)
    real(wp), intent(inout) :: y(:, :)
    type(machine_state_t) :: state
    real(wp) :: moments(machine%bodies)
    integer :: l, n

    n = machine%bodies
    state = new_machine_state(machine)
    call state%elements%gather(machine%elements%rows, phi, omega)
    call state%choose_branches(machine, [(0.0_wp, l=1, machine%lanes)])
    call bring_to(machine, state, [(0.0_wp, l=1, machine%lanes)], phi, omega)
    do l = 1, machine%lanes
      call elastic_moments(machine, state%elements, l, moments)
      y(l, 2 * n + 1:3 * n) = moments
    end do
  end subroutine place_moments

  !> Chooses the branches of all lanes at their states.
  subroutine enter_all(formulation, t, y)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t(:)
    real(wp), intent(in) :: y(:, :)
    real(wp) :: state(size(y, 2))
    integer :: l

    do l = 1, formulation%lanes
      state = y(l, :)
      call formulation%start_lane(l, t(l), state)
    end do
  end subroutine enter_all

  !> Sets the elements to a state and evaluates all that the paper's matrices need.
  subroutine bring_to(machine, state, t, phi, omega)
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)

    call state%elements%gather(machine%elements%rows, phi, omega)
    call state%evaluate_elements(machine, t)
    call state%differentiate_elements(machine, t)
    call state%evaluate_energies(machine)
  end subroutine bring_to

end module nocdyn_test_states
