!> The values of signals over the time, for all lanes of a block.
module nocdyn_signal_values
  use nocdyn_bank, only: role_coupling
  use nocdyn_elements, only: element_values_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_quantities, only: form_angle, form_applied, form_elastic, form_speed, form_total
  use nocdyn_shafts, only: shafts_t
  use nocdyn_signals, only: signal_angle, signal_elastic, signal_element, signal_kinetic, signal_member, &
    signal_point_moment, signal_point_stress, signal_reaction, signal_residual, signal_speed, signal_source_t, signal_time, &
    signal_work_in, signal_work_out
  implicit none (type, external)
  private

  public :: new_signal_values, may_bend

  !> Signals one after the other whose indices are consecutive.
  type, extends(signal_source_t) :: segment_t
    integer :: first = 1, last = 1     !! signals; `index` belongs to the first
    logical :: has_new_values = .true. !! whether the segment before is of another bank or quantity
  end type segment_t

  !> Evaluates a formulation, which may be in use by an integration: nothing is changed on which the integration depends.
  type, public :: signal_values_t
    class(formulation_t), pointer :: formulation => null()
    logical :: in_motion = .false.                       !! whether joints have the modes of an integration; else by the state
    type(segment_t), allocatable, private :: segments(:)
    logical, private :: have_reactions = .false.
    logical, private :: have_energies = .false.          !! whether a column is an energy or a work
    logical, private :: have_elastic = .false., have_works = .false.   !! whether a column needs these
    real(wp), allocatable, private :: values(:)          !! of one quantity of a bank; work space
    real(wp), allocatable, private :: lambda(:)          !! multipliers of the constraint rows; work space
    integer, allocatable, private :: works_in(:)         !! indices of the works that count as put in, in the quadratures
    integer, allocatable, private :: works_out(:)        !! of the other elements
    real(wp), private :: energies(signal_kinetic:signal_residual) = 0.0_wp   !! of one row [J]; work space
    real(wp), allocatable, private :: start_energy(:)    !! [J], [lanes]
    real(wp), allocatable, private :: start_kept(:)      !! of this what internal states keep
  contains
    procedure :: start_lane, observe, fill_row, kinetic_energy, find_pace
  end type signal_values_t

contains

  !> An evaluator of some columns.
  type(signal_values_t) function new_signal_values(formulation, columns) result(self)
    class(formulation_t), target, intent(inout) :: formulation   !! with work integrals if a column needs them
    type(signal_source_t), intent(in) :: columns(:)
    logical, allocatable :: is_source(:)   ! [quadratures]
    integer :: i

    if (any(columns%kind >= signal_work_in) .and. .not. formulation%has_energy_balance) then
      error stop 'nocdyn_signal_values: work columns need a formulation with an energy balance'
    end if
    self%formulation => formulation
    allocate (self%segments, source=segments_of(columns))
    self%have_reactions = any(columns%kind == signal_reaction .or. columns%kind == signal_member)
    self%have_energies = any(columns%kind >= signal_kinetic)
    self%have_elastic = any(columns%kind >= signal_elastic)
    self%have_works = any(columns%kind >= signal_work_in)
    associate (banks => formulation%machine%banks)
      allocate (self%values(maxval([(banks(i)%bank%count, i=1, size(banks))])), source=0.0_wp)
      allocate (is_source, source=[(spread(banks(i)%bank%is_source(), 1, size(banks(i)%bank%with_work)), i=1, size(banks))])
    end associate
    allocate (self%works_in, source=pack([(i, i=1, size(is_source))], is_source))
    allocate (self%works_out, source=pack([(i, i=1, size(is_source))], .not. is_source))
    allocate (self%lambda(formulation%machine%constraints%rows()), source=0.0_wp)
    allocate (self%start_energy(formulation%lanes), self%start_kept(formulation%lanes), source=0.0_wp)
  end function new_signal_values

  !> The columns as few segments.
  pure function segments_of(columns) result(segments)
    type(signal_source_t), intent(in) :: columns(:)
    type(segment_t), allocatable :: segments(:)
    type(segment_t) :: all(0:size(columns))
    logical :: is_of_same
    integer :: i, n

    n = 0
    all(0)%kind = 0   ! of no column
    do i = 1, size(columns)
      is_of_same = columns(i)%body == 0 .and. columns(i)%kind == all(n)%kind .and. columns(i)%bank == all(n)%bank .and. &
                   columns(i)%quantity == all(n)%quantity
      if (is_of_same .and. columns(i)%index == all(n)%index + i - all(n)%first) then
        all(n)%last = i
        cycle
      end if
      n = n + 1
      all(n)%signal_source_t = columns(i)
      all(n)%first = i
      all(n)%last = i
      all(n)%has_new_values = .not. is_of_same
    end do
    segments = all(1:n)
  end function segments_of

  !> Whether a column may bend more than the solution: torques, reactions and what follows from them, but not moments in
  !> proportion to twists and their rates.
  logical function may_bend(machine, column, varies)
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: column
    logical, intent(in) :: varies   !! whether cubic stiffnesses vary

    may_bend = any(column%kind == [signal_element, signal_reaction, signal_member])
    if (column%kind /= signal_element .or. column%body > 0) return
    associate (bank => machine%banks(column%bank)%bank)
      if (bank%role == role_coupling .and. bank%has_paper_law .and. bank%has_polynomial_potential) then
        may_bend = varies .or. any(abs(machine%laws%cubic(:, bank%first:bank%last())) > 0)
      end if
    end associate
  end function may_bend

  !> How fast the columns of a lane oscillate where they were observed last, and the size of its moments.
  subroutine find_pace(self, lane, fastest, scale)
    class(signal_values_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: fastest   !! [rad/s]
    real(wp), intent(out) :: scale     !! [N m]

    fastest = self%formulation%fastest_wave(lane)
    associate (elements => self%formulation%state%elements)
      scale = 0.0_wp
      if (size(elements%applied, 2) > 0) scale = maxval(abs(elements%applied(lane, :))) + maxval(abs(elements%restoring(lane, :)))
    end associate
  end subroutine find_pace

  !> Stores the energy of a lane at its start, after `observe` there.
  subroutine start_lane(self, lane)
    class(signal_values_t), intent(inout) :: self
    integer, intent(in) :: lane

    if (.not. self%have_elastic) return
    associate (elements => self%formulation%state%elements)
      self%start_energy(lane) = self%kinetic_energy(lane) + sum(elements%stored(lane, :))
      self%start_kept(lane) = sum(elements%kept(lane, :))
    end associate
  end subroutine start_lane

  !> Evaluates the machine of all lanes at a time and state.
  subroutine observe(self, t, y)
    class(signal_values_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states + quadratures]
    integer :: lost

    associate (formulation => self%formulation)
      lost = formulation%joints%lost
      call formulation%state%keep_branches()
      call formulation%observe(t, y, self%in_motion)
      if (self%have_elastic) call formulation%state%evaluate_energies(formulation%machine)
      call formulation%state%restore_branches(formulation%machine)
      formulation%joints%lost = lost
    end associate
  end subroutine observe

  !> The values of a lane's columns, after `observe` at (t, y).
  subroutine fill_row(self, lane, t, y, row)
    class(signal_values_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! of the lane, [states + quadratures]
    real(wp), intent(inout) :: row(:)          !! [columns]
    integer :: k, m

    if (self%have_reactions) call self%formulation%reactions(lane, self%lambda)
    if (self%have_energies) call find_energies(self, lane, y)
    associate (machine => self%formulation%machine, members => self%formulation%machine%constraints%members)
      do k = 1, size(self%segments)
        associate (segment => self%segments(k), first => self%segments(k)%first, last => self%segments(k)%last, &
                   i => self%segments(k)%index, j => self%segments(k)%index + self%segments(k)%last - self%segments(k)%first)
          select case (segment%kind)
          case (signal_time)
            row(first) = t
          case (signal_angle)
            row(first:last) = self%formulation%phi(lane, i:j)
          case (signal_speed)
            row(first:last) = self%formulation%omega(lane, i:j)
          case (signal_element)
            if (segment%has_new_values) call observe_bank(machine, self%formulation%state%elements, segment, lane, self%values)
            row(first:last) = self%values(i:j)
            if (segment%body > 0) row(first) = row(first) * self%formulation%omega(lane, segment%body)
          case (signal_reaction)
            row(first:last) = self%lambda(i:j)
          case (signal_member)
            do m = i, j
              row(first + m - i) = members%factor(lane, m) * self%lambda(members%row(m))
            end do
          case (signal_point_moment, signal_point_stress)
            call fill_points(machine, self%formulation%state%elements, segment, lane, row(first:last))
          case (signal_kinetic:signal_residual)
            row(first) = self%energies(segment%kind)
          case default
            error stop 'nocdyn_signal_values: there is no such column'
          end select
        end associate
      end do
    end associate
  end subroutine fill_row

  !> The values of one quantity of a bank. A sum with 0 makes no -0.
  subroutine observe_bank(machine, elements, segment, lane, values)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements   !! of the machine
    type(segment_t), intent(in) :: segment
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: values(:)   !! [elements of the bank at least]

    associate (bank => machine%banks(segment%bank)%bank)
      associate (first => bank%first, last => bank%last(), factor => segment%factor, &
                 n => bank%count)
        select case (segment%form)
        case (form_angle)
          values(:n) = 0.0_wp + factor * elements%angle(lane, first:last)
        case (form_speed)
          values(:n) = 0.0_wp + factor * elements%speed(lane, first:last)
        case (form_elastic)
          values(:n) = 0.0_wp + factor * elements%restoring(lane, first:last)
        case (form_applied)
          values(:n) = 0.0_wp + factor * elements%applied(lane, first:last)
        case (form_total)
          values(:n) = 0.0_wp + factor * (elements%restoring(lane, first:last) + elements%applied(lane, first:last))
        case default
          call bank%observe(elements, segment%quantity, lane, values(:n))
        end select
        if (segment%divisor == 0) return
        associate (divisor => bank%parameters(segment%divisor)%value(lane, :))
          values(:n) = values(:n) / merge(divisor, 1.0_wp, divisor > 0)
        end associate
      end associate
    end associate
  end subroutine observe_bank

  !> The moments or stresses at points of a shaft.
  subroutine fill_points(machine, elements, segment, lane, values)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements   !! of the machine
    type(segment_t), intent(in) :: segment
    integer, intent(in) :: lane
    real(wp), intent(inout) :: values(:)   !! [N m] or [Pa]
    integer :: p

    select type (bank => machine%banks(segment%bank)%bank)
    type is (shafts_t)
      do p = 1, size(values)
        values(p) = bank%moment_at(elements, segment%quantity, segment%index + p - 1, lane)
      end do
      if (segment%kind == signal_point_stress) then
        associate (moduli => bank%parameters(bank%number_of('shaft_modulus'))%value, &
                   first => bank%shafts(segment%quantity)%first_point + segment%index - 1)
          values(:) = values / moduli(lane, first:first + size(values) - 1)
        end associate
      end if
    class default
      error stop 'nocdyn_signal_values: the points are of a shaft'
    end select
  end subroutine fill_points

  !> Energies and works of one lane, one number for each kind of column.
  subroutine find_energies(self, lane, y)
    type(signal_values_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]

    associate (energies => self%energies)
      energies(signal_kinetic) = self%kinetic_energy(lane)
      if (self%have_elastic) energies(signal_elastic) = sum(self%formulation%state%elements%stored(lane, :))
      if (.not. self%have_works) return
      energies(signal_work_in) = work(self%works_in, self%formulation%states, y)
      energies(signal_work_out) = work(self%works_out, self%formulation%states, y) &
                                  + sum(self%formulation%state%elements%kept(lane, :)) - self%start_kept(lane)
      energies(signal_residual) = (energies(signal_kinetic) + energies(signal_elastic) - self%start_energy(lane)) &
                                  - (energies(signal_work_in) + energies(signal_work_out))
      energies(signal_work_out) = 0.0_wp - energies(signal_work_out)   ! not -0 without any work
    end associate
  end subroutine find_energies

  !> The kinetic energy of a lane after `observe` [J].
  pure real(wp) function kinetic_energy(self, lane)
    class(signal_values_t), intent(in) :: self
    integer, intent(in) :: lane

    kinetic_energy = self%formulation%machine%kinetic_energy(lane, self%formulation%omega(lane, 1:))
  end function kinetic_energy

  !> The sum of some work integrals of a lane, positive into the machine [J].
  pure real(wp) function work(works, states, y)
    integer, intent(in) :: works(:)   !! indices in the quadratures
    integer, intent(in) :: states     !! their number, before the quadratures
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    work = 0.0_wp
    do i = 1, size(works)
      work = work + y(states + works(i))
    end do
  end function work

end module nocdyn_signal_values
