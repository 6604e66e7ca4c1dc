!> Reports on derivatives: the printed ranking, sensitivity.csv and sensitivity.json.
module nocdyn_sensitivity_report
  use nocdyn_answers, only: answer_t
  use nocdyn_csv, only: text_cell
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_output_file, only: output_file_t
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_varied_keys, only: varied_key_t
  implicit none (type, external)
  private

  public :: put_sensitivity, sensitivity_csv, sensitivity_text

  integer, parameter :: most_answers = 40, most_of_answer = 4   ! that are printed; all are in the files
  real(wp), parameter :: percent = 100.0_wp
  real(wp), parameter :: least = 1.0e-3_wp     ! a smaller share of the largest effect is not printed
  character(len=*), parameter :: line_end = new_line('a')

  !> What has been found.
  type, public :: sensitivity_t
    type(varied_key_t), allocatable :: keys(:)
    type(answer_t), allocatable :: answers(:)
    type(string_t), allocatable :: notes(:)
  contains
    procedure :: effects
  end type sensitivity_t

contains

  !> By how much an answer changes if a number grows by one per cent, an angle by one degree: as a share of the answer [%], of
  !> shares in points [%], [keys].
  pure function effects(self, answer)
    class(sensitivity_t), intent(in) :: self
    integer, intent(in) :: answer
    real(wp) :: effects(size(self%keys))

    associate (one => self%answers(answer))
      effects = percent * one%derivative * self%keys%small
      if (one%is_share) return
      if (abs(one%value) > 0) effects = effects / abs(one%value)
    end associate
  end function effects

  !> The keys in the order of their effects on an answer, the largest first.
  function ranking(self, answer) result(order)
    type(sensitivity_t), intent(in) :: self
    integer, intent(in) :: answer
    integer, allocatable :: order(:)

    order = ascending_order(-abs(self%effects(answer)))
  end function ranking

  !> For every answer the numbers with the largest effects.
  function sensitivity_text(file, self) result(text)
    character(len=*), intent(in) :: file
    type(sensitivity_t), intent(in) :: self
    character(len=:), allocatable :: line, text
    type(text_buffer_t) :: report
    integer, allocatable :: order(:)
    integer :: i, k
    real(wp) :: effect(size(self%keys))

    call append_notes(report, file, self%notes)
    call report%append_line(file // ': derivatives by ' // to_text(size(self%keys)) // ' numbers; what one per cent more of ' // &
                            'each does, of angles one degree')
    do i = 1, min(size(self%answers), most_answers)
      associate (one => self%answers(i))
        call report%append_line('  ' // one%kind // ' of ' // one%label // ' = ' // value_text(one))
        order = ranking(self, i)
        effect = self%effects(i)
        line = ''
        do k = 1, min(size(order), most_of_answer)
          if (abs(effect(order(k))) <= least * abs(effect(order(1)))) exit
          if (k > 1) line = line // ', '
          line = line // signed(effect(order(k))) // trim(merge(' points', ' %     ', one%is_share)) // ' ' // &
                 self%keys(order(k))%target%path
        end do
        if (line == '') cycle
        call report%append_line('    ' // line)
        if (one%kind == 'margin') call append_sentence(one, self%keys(order(1)), effect(order(1)), report)
      end associate
    end do
    if (size(self%answers) > most_answers) then
      call report%append_line('  (' // to_text(size(self%answers) - most_answers) // ' more in sensitivity.csv)')
    end if
    text = report%text()
  end function sensitivity_text

  !> "the margin of mode 1, order 4.5 gains 1 point for +1.2 % of coupling.rubber.stiffness".
  subroutine append_sentence(answer, key, effect, report)
    type(answer_t), intent(in) :: answer
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: effect
    type(text_buffer_t), intent(inout) :: report

    if (key%small_text /= '1 %' .or. .not. abs(effect) > 0) return
    call report%append_line('    the margin of ' // answer%label // ' gains 1 point for ' // signed(1.0_wp / effect) // &
                            ' % of ' // key%target%path)
  end subroutine append_sentence

  function value_text(answer) result(text)
    type(answer_t), intent(in) :: answer
    character(len=:), allocatable :: text

    if (answer%is_share) then
      text = rounded_text(percent * answer%value, 6) // ' %'
    else
      text = rounded_text(answer%value, 8)
      if (answer%unit /= '') text = text // ' ' // answer%unit
    end if
  end function value_text

  function signed(value) result(text)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: text

    text = rounded_text(value, 4)
    if (value > 0) text = '+' // text
  end function signed

  !> Writes sensitivity.csv: a row for each answer and number, those of an answer in the order of their effects.
  subroutine sensitivity_csv(self, file)
    type(sensitivity_t), intent(in) :: self
    type(output_file_t), intent(inout) :: file
    integer, allocatable :: order(:)
    integer :: i, k
    real(wp) :: effect(size(self%keys))

    call file%put('answer,of,value,unit,number,number_value,number_unit,derivative,change,effect [%]' // line_end)
    do i = 1, size(self%answers)
      order = ranking(self, i)
      effect = self%effects(i)
      associate (one => self%answers(i))
        do k = 1, size(order)
          associate (key => self%keys(order(k)))
            call file%put(one%kind // ',"' // one%label // '",' // to_text(one%value) // ',' // one%unit // ',' // &
                          text_cell(key%target%path) // ',' // to_text(key%value) // ',' // key%target%unit)
            call file%put(',' // to_text(one%derivative(order(k))) // ',' // trim(key%small_text) // ',' // &
                          to_text(effect(order(k))))
            call file%put(line_end)
          end associate
        end do
      end associate
    end do
  end subroutine sensitivity_csv

  !> The members of sensitivity.json: the numbers, and the answers with their derivatives in the order of the numbers.
  subroutine put_sensitivity(json, input, self)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(sensitivity_t), intent(in) :: self
    integer :: i

    call open_analysis_report(json, input)
    call json%put('notes', self%notes)
    call json%open_list('numbers')
    do i = 1, size(self%keys)
      call json%open()
      call json%put('path', self%keys(i)%target%path)
      call json%put('value', self%keys(i)%value)
      call json%put('unit', self%keys(i)%target%unit)
      call json%put('change', trim(self%keys(i)%small_text))
      call json%close()
    end do
    call json%close_list()
    call json%open_list('answers')
    do i = 1, size(self%answers)
      associate (one => self%answers(i))
        call json%open()
        call json%put('kind', one%kind)
        call json%put('of', one%label)
        call json%put('value', one%value)
        call json%put('unit', one%unit)
        call json%put('derivative', one%derivative)
        call json%put('effect_percent', self%effects(i))
        call json%close()
      end associate
    end do
    call json%close_list()
    call json%close()
  end subroutine put_sensitivity

end module nocdyn_sensitivity_report
