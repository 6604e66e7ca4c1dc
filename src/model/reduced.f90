!> The reduced formulation: L_tau^T J L_tau q'' = L_tau^T (Q + C omega + K phi), states q', q and the works.
module nocdyn_reduced
  use nocdyn_bank, only: bank_t
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: evaluation_fine
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: new_reduced

  !> The entries of the coordinates that an element's relative angle depends on, with the sign of its terminal.
  type :: terminals_t
    integer, allocatable :: first(:)    !! [elements + 1]
    integer, allocatable :: entry(:)
    real(wp), allocatable :: sign(:)    !! 1 for `to`, -1 for `from`
  end type terminals_t

  !> q is counted from the start: phi = start_angle + L_tau q.
  type, extends(formulation_t), public :: reduced_t
    type(terminals_t), allocatable, private :: terminals(:)   !! of each bank
  contains
    procedure :: derivative
    procedure :: jacobian
    procedure :: component_name
    procedure :: start
    procedure :: place
    procedure :: reactions
  end type reduced_t

contains

  !> The formulation of a machine whose coordinates are known.
  function new_reduced(machine) result(self)
    type(machine_t), intent(in) :: machine
    type(reduced_t) :: self
    integer :: i

    call self%attach(machine)
    self%states = 2 * machine%coordinates%freedoms
    allocate (self%terminals(size(machine%banks)))
    do i = 1, size(machine%banks)
      self%terminals(i) = terminals_of(machine%banks(i)%bank, machine%coordinates)
    end do
  end function new_reduced

  function terminals_of(bank, coordinates) result(terminals)
    class(bank_t), intent(in) :: bank
    type(coordinates_t), intent(in) :: coordinates
    type(terminals_t) :: terminals
    integer :: e, next

    allocate (terminals%first(size(bank%to) + 1))
    terminals%first(1) = 1
    do e = 1, size(bank%to)
      terminals%first(e + 1) = terminals%first(e) + entries(coordinates, bank%to(e)) + entries(coordinates, bank%from(e))
    end do
    allocate (terminals%entry(terminals%first(size(terminals%first)) - 1))
    allocate (terminals%sign(size(terminals%entry)))
    do e = 1, size(bank%to)
      next = terminals%first(e)
      call append(coordinates, bank%to(e), 1.0_wp, terminals, next)
      call append(coordinates, bank%from(e), -1.0_wp, terminals, next)
    end do
  end function terminals_of

  pure integer function entries(coordinates, body)
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body

    entries = 0
    if (body > 0) entries = coordinates%first(body + 1) - coordinates%first(body)
  end function entries

  subroutine append(coordinates, body, sign, terminals, next)
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body
    real(wp), intent(in) :: sign
    type(terminals_t), intent(inout) :: terminals
    integer, intent(inout) :: next
    integer :: i

    do i = 0, entries(coordinates, body) - 1
      terminals%entry(next) = coordinates%first(body) + i
      terminals%sign(next) = sign
      next = next + 1
    end do
  end subroutine append

  function start(self) result(y)
    class(reduced_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)
    integer :: l

    allocate (y(self%lanes, self%states + self%quadratures), source=0.0_wp)
    do l = 1, self%lanes
      call self%machine%coordinates%project(l, self%machine%inertia(l, :), self%machine%start_speed(l, :), &
                                            y(l, :self%machine%coordinates%freedoms))
    end do
  end function start

  !> omega = L_tau q', eq. (82) of section 5.
  subroutine place(self, y)
    class(reduced_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)
    integer :: b, c, f, k, l

    f = self%machine%coordinates%freedoms
    associate (coordinates => self%machine%coordinates, start_angle => self%machine%start_angle)
      do b = 1, self%machine%bodies
        self%omega(:, b) = 0.0_wp
        self%phi(:, b) = start_angle(:, b)
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          c = coordinates%coordinate(k)
          do l = 1, self%lanes
            self%omega(l, b) = self%omega(l, b) + coordinates%ratio(l, k) * y(l, c)
            self%phi(l, b) = self%phi(l, b) + coordinates%ratio(l, k) * y(l, f + c)
          end do
        end do
      end do
    end associate
  end subroutine place

  subroutine derivative(self, t, y, dydt, status)
    class(reduced_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dydt(:, :)
    integer, contiguous, intent(inout) :: status(:)
    integer :: f

    f = self%machine%coordinates%freedoms
    call self%place(y)
    call self%machine%evaluate(t, self%phi, self%omega, self%torque)
    call accelerate(self%machine%coordinates, self%torque, dydt)
    dydt(:, f + 1:2 * f) = y(:, :f)
    call self%machine%power(dydt(:, 2 * f + 1:))
    status = evaluation_fine
  end subroutine derivative

  !> q'' = (L_tau^T J L_tau)^-1 L_tau^T T.
  subroutine accelerate(coordinates, torque, acceleration)
    type(coordinates_t), intent(in) :: coordinates
    real(wp), contiguous, intent(in) :: torque(:, 0:)           !! [lanes, ground and bodies]
    real(wp), contiguous, intent(inout) :: acceleration(:, :)   !! [lanes, at least freedoms]
    integer :: b, c, k, l

    acceleration(:, :coordinates%freedoms) = 0.0_wp
    do b = 1, size(torque, 2) - 1
      do k = coordinates%first(b), coordinates%first(b + 1) - 1
        c = coordinates%coordinate(k)
        do l = 1, size(torque, 1)
          acceleration(l, c) = acceleration(l, c) + coordinates%response(l, k) * torque(l, b)
        end do
      end do
    end do
  end subroutine accelerate

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(reduced_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :)
    real(wp), contiguous, intent(inout) :: dfdt(:, :)
    integer, contiguous, intent(inout) :: status(:)
    integer :: c, f, i, work

    f = self%machine%coordinates%freedoms
    call self%place(y)
    call self%machine%differentiate(t, self%phi, self%omega)
    dfdy(:, :, :) = 0.0_wp
    dfdt(:, :) = 0.0_wp
    do c = 1, f
      dfdy(:, f + c, c) = 1.0_wp
    end do
    work = 2 * f
    do i = 1, size(self%machine%banks)
      associate (bank => self%machine%banks(i)%bank)
        call add_accelerations(bank, self%terminals(i), self%machine%coordinates, dfdy, dfdt)
        call add_powers(bank, self%terminals(i), self%machine%coordinates, work, dfdy, dfdt)
        work = work + size(bank%accounted)
      end associate
    end do
    status = evaluation_fine
  end subroutine jacobian

  !> The rows q'' of the Jacobian: every element couples the coordinates of its two bodies.
  subroutine add_accelerations(bank, terminals, coordinates, dfdy, dfdt)
    class(bank_t), intent(in) :: bank
    type(terminals_t), intent(in) :: terminals
    type(coordinates_t), intent(in) :: coordinates
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :)
    real(wp), contiguous, intent(inout) :: dfdt(:, :)
    real(wp) :: response
    integer :: c, e, f, i, j, l, q

    f = coordinates%freedoms
    do e = 1, size(bank%to)
      do i = terminals%first(e), terminals%first(e + 1) - 1
        c = coordinates%coordinate(terminals%entry(i))
        do l = 1, size(dfdt, 1)
          response = terminals%sign(i) * coordinates%response(l, terminals%entry(i))
          dfdt(l, c) = dfdt(l, c) + response * bank%working_time(l, e)
          do j = terminals%first(e), terminals%first(e + 1) - 1
            q = coordinates%coordinate(terminals%entry(j))
            associate (gain => response * terminals%sign(j) * coordinates%ratio(l, terminals%entry(j)))
              dfdy(l, c, q) = dfdy(l, c, q) + gain * bank%working_speed(l, e)
              dfdy(l, c, f + q) = dfdy(l, c, f + q) + gain * (bank%restoring_angle(l, e) + bank%working_angle(l, e))
            end associate
          end do
        end do
      end do
    end do
  end subroutine add_accelerations

  !> The rows of the integrated works: the power is M u', M the working moment.
  subroutine add_powers(bank, terminals, coordinates, row, dfdy, dfdt)
    class(bank_t), intent(in) :: bank
    type(terminals_t), intent(in) :: terminals
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: row   !! the row before the bank's first
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :)
    real(wp), contiguous, intent(inout) :: dfdt(:, :)
    integer :: a, e, f, j, l, q

    f = coordinates%freedoms
    do a = 1, size(bank%accounted)
      e = bank%accounted(a)
      do l = 1, size(dfdt, 1)
        dfdt(l, row + a) = bank%working_time(l, e) * bank%speed(l, e)
        do j = terminals%first(e), terminals%first(e + 1) - 1
          q = coordinates%coordinate(terminals%entry(j))
          associate (ratio => terminals%sign(j) * coordinates%ratio(l, terminals%entry(j)), speed => bank%speed(l, e))
            dfdy(l, row + a, q) = dfdy(l, row + a, q) + ratio * (bank%working(l, e) + speed * bank%working_speed(l, e))
            dfdy(l, row + a, f + q) = dfdy(l, row + a, f + q) + ratio * speed * bank%working_angle(l, e)
          end associate
        end do
      end do
    end do
  end subroutine add_powers

  !> Tooth forces straight from the torques of the elements.
  subroutine reactions(self, lane, lambda)
    class(reduced_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: lambda(:)

    call self%machine%coordinates%reactions_of_torques(lane, self%torque(lane, 1:), lambda)
  end subroutine reactions

  function component_name(self, index) result(name)
    class(reduced_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    associate (coordinates => self%machine%coordinates)
      if (index <= coordinates%freedoms) then
        name = 'speed of ' // quoted(self%machine%names(coordinates%body(index))%text)
      else if (index <= self%states) then
        name = 'angle of ' // quoted(self%machine%names(coordinates%body(index - coordinates%freedoms))%text)
      else
        name = 'work of ' // quoted(self%machine%accounted_name(index - self%states))
      end if
    end associate
  end function component_name

end module nocdyn_reduced
